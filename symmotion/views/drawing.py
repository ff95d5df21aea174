"""Pictures of motions, on axes that the caller brings."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, to_rgba

from symmotion.bodies import Body, Shape
from symmotion.brief import start_of
from symmotion.motions import AffineMotion, Keyframes
from symmotion.motions.motion import Motion
from symmotion.program import Program
from symmotion.systems import kkt_pattern
from symmotion.views.canvas import MOST_MARKERS, thinned, told
from symmotion.views.parallel import VIEW, bare
from symmotion.views.style import COLOURS, INK, STYLES

# A deviation from rigid of keyframes below this is none that inner products show; and how far down it is drawn.
NEARLY, DEPTH = 1e-3, 1e-6


def draw_body(
    axes: Axes,
    motion: Motion,
    body: Shape,
    times: np.ndarray,
    colour: str = COLOURS[0],
    alpha: float = 0.4,
) -> None:
    """A planar body at several times of a planar motion.

    axes: of Matplotlib; body: of any form that `Body.of` takes; times: (N,); colour, alpha: of the copies.

    Raises InputError for a body that is none.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_body(figure.add_subplot(), motion, sm.bodies.eight_ellipses(), np.linspace(0, 1, 5))
    """
    shape = Body.of(body, 2)
    for t in times:
        outlines = shape.polygons(motion.trajectory(shape.vertices, t))
        axes.add_collection(PolyCollection(outlines, facecolors=colour, edgecolors=colour, alpha=alpha, linewidths=0.7))
    bare(axes)


def draw_path(axes: Axes, motion: Motion, point: Sequence[float] = (0.0, 0.0)) -> None:
    """The path of a body point of a planar motion.

    axes: of Matplotlib; point: (2,), the origin when left out.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_path(figure.add_subplot(), motion, (1.0, 0.0))
    """
    path = motion.trajectory(point, np.linspace(*motion.domain, 300))[:, 0]
    axes.plot(path[:, 0], path[:, 1], color=INK, linewidth=0.8, alpha=0.6)


def draw_inner_products(
    axes: Axes, motion: AffineMotion, keyframes: Keyframes | None = None, vectors: np.ndarray | None = None
) -> None:
    """Inner products of the moving test vectors over time, a line per pair; those at the keyframes as dots.

    vectors: (d, T) columns, the unit vectors when left out.

    axes: of Matplotlib; motion: affine.

    >>> keys = sm.examples.quarter_turn()
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_inner_products(figure.add_subplot(), sm.interpolants.component_cubic(keys), keys)
    """
    q = np.eye(motion.dimension) if vectors is None else np.asarray(vectors)
    t = _instants(motion)
    products = q.T @ motion.gram(t) @ q
    start = start_of(t)
    pairs = [(i, j) for i in range(q.shape[1]) for j in range(i, q.shape[1])]
    # Squared lengths in full lines, mixed products dashed: the two groups are read against 1 and 0.
    for k, (i, j) in enumerate(sorted(pairs, key=lambda p: p[0] != p[1])):
        style = "-" if i == j else "--"
        colour = COLOURS[k % len(COLOURS)]
        line = thinned(t - start, products[:, i, j])
        axes.plot(*line, style, color=colour, label=f"$q_{i + 1}\\cdot q_{j + 1}$")
        if keyframes is not None and len(keyframes) <= MOST_MARKERS:
            a = keyframes.linear @ q
            values = np.sum(a[:, :, i] * a[:, :, j], axis=1)
            axes.plot(keyframes.times - start, values, "o", color=colour, markersize=3.5)
    axes.set_xlabel(told(t)[1])


def draw_deviation(axes: Axes, motions: Mapping[str, AffineMotion]) -> None:
    """How far motions are from rigid, ‖AᵀA − I‖ over time on a logarithmic scale, a line for each.

    axes: of Matplotlib; motions: affine, by their labels.

    >>> motion = sm.interpolants.component_cubic(sm.examples.quarter_turn())
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_deviation(figure.add_subplot(), {"spline": motion})
    """
    axes.set_yscale("log")
    largest = 0.0
    for k, (label, motion) in enumerate(motions.items()):
        t = _instants(motion)
        deviation = np.linalg.norm(motion.gram(t) - np.eye(motion.dimension), axis=(1, 2))
        largest = max(largest, float(deviation.max()))
        shown, name = told(t)
        axes.plot(*thinned(shown, deviation), STYLES[k % 3], color=COLOURS[k], linewidth=1.2, label=label)
        axes.set_xlabel(name)
    # At the keyframes it is that of the keyframes, which may be rounding: what is drawn is what lies between.
    axes.set_ylim(bottom=DEPTH * largest if largest > 0 else None)
    axes.set_ylabel("‖AᵀA − I‖")


def nearly_rigid(keyframes: Keyframes) -> bool:
    """Whether keyframes are rigid as far as a picture of inner products tells: ‖AᵀA − I‖ ≤ 10⁻³.

    >>> sm.views.nearly_rigid(sm.examples.quarter_turn()), sm.views.nearly_rigid(sm.examples.planar_keyframes())
    (True, False)
    """
    gram = np.swapaxes(keyframes.linear, 1, 2) @ keyframes.linear
    return bool(np.linalg.norm(gram - np.eye(keyframes.dimension), axis=(1, 2)).max() <= NEARLY)


def _instants(motion: AffineMotion) -> np.ndarray:
    """Times of which each span between breakpoints has some."""
    return np.linspace(*motion.domain, max(401, 10 * len(motion.basis.breakpoints)))


def draw_kkt(axes: Axes, program: Program) -> None:
    """Where the saddle matrix [[H, Jᵀ], [J, 0]] of a program can differ from zero; a line sets off the multipliers.

    axes: of Matplotlib.

    Raises InputError for what is no program.

    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_kkt(figure.add_subplot(), sm.affine_program(sm.examples.planar_keyframes()))
    """
    pattern = kkt_pattern(program).toarray()
    axes.imshow(np.where(pattern, 1.0, np.nan), cmap=ListedColormap([COLOURS[0]]), interpolation="nearest")
    for line in (axes.axhline, axes.axvline):
        line(program.unknowns - 0.5, color=INK, linewidth=0.6)
    axes.grid(False)
    axes.set_title(f"{pattern.shape[0]} rows, {100 * pattern.mean():.3g} % filled")


def draw_ellipsoid(
    axes: Axes, motion: Motion, times: np.ndarray, semi_axes: Sequence[float], ink: bool = False
) -> None:
    """An ellipsoid at several times of a spatial motion, as its principal ellipses seen from afar; `ink`: all dark.

    axes: of Matplotlib; times: (N,); semi_axes: three, along the axes of the body.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_ellipsoid(figure.add_subplot(), motion, np.linspace(0, 1, 5), [1.0, 0.7, 0.5])
    """
    s = np.linspace(0, 2 * np.pi, 49)
    circle = np.column_stack([np.cos(s), np.sin(s), np.zeros_like(s)])
    view = VIEW[:, :2]
    rings = np.concatenate([np.roll(circle, k, axis=1) * semi_axes for k in range(3)])
    outlines = (motion.trajectory(rings, times) @ view).reshape(-1, len(s), 2)
    colours = [INK if ink else COLOURS[k % 3] for k in range(len(outlines))]
    faces = [to_rgba(colour, 0.12) for colour in colours]
    width = 1.3 if ink else 0.7
    axes.add_collection(
        # Matplotlib's stubs know lists only, which are drawn more slowly.
        PolyCollection(outlines, facecolors=faces, edgecolors=colours, linewidths=width)  # pyright: ignore[reportArgumentType]
    )
    path = motion(np.linspace(*motion.domain, 300)).translation @ view
    axes.plot(path[:, 0], path[:, 1], color=INK, linewidth=0.8, alpha=0.6)
    bare(axes)

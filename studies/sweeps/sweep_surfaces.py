"""HJK figure 6: sweep surfaces of spline profiles under affine spline motions, a band, a vase and a flower."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import symmotion as sm
from studies.affine.several_keyframes import start_of
from studies.sweeps.swept_volumes import columns, where_solvers_end
from symmotion.report import Figure, Player, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.sweeps import SweepSurface, sweep_surface
from symmotion.views import COLOURS, draw_curve, draw_mesh, new_figure, view_from

BAND_VIEW = view_from([0.6, -2.0, 2.2])
ABOVE = view_from([1.2, -2.4, 1.3])
Rows = list[tuple[Any, ...]]
RIGIDITY = sm.Rigidity(2)
# Square body points, for the paths: R* alone does not see the translation.
PATHS = sm.TrajectoryEnergy(np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0]]))
OBJECTIVE = RIGIDITY + 0.01 * PATHS


def wave() -> sm.splines.Spline:
    """An open profile in the plane of y and z."""
    points = np.array([[0, -1.0, 0.1], [0, -0.6, -0.25], [0, 0, 0.45], [0, 0.6, -0.25], [0, 1.0, 0.1]])
    return sm.splines.cubic_interpolant(np.linspace(0, 1, 5), points)


def lobes(count: int, depth: float) -> sm.splines.Spline:
    """A closed profile in the plane of x and y: a circle with `count` lobes."""
    angle = np.linspace(0, 2 * np.pi, 8 * count + 1)
    radius = 1 + depth * np.cos(count * angle)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])
    points[-1] = points[0]
    return sm.splines.cubic_interpolant(angle, points, "periodic")


def band() -> sm.Keyframes:
    """Five positions along a winding path, sheared and stretched."""
    angles = np.deg2rad([0, 35, 80, 20, -30])
    c, s, o = np.cos(angles), np.sin(angles), np.zeros(5)
    turns = np.stack([np.stack([c, -s, o], -1), np.stack([s, c, o], -1), np.stack([o, o, o + 1], -1)], axis=-2)
    sizes = np.array([[1, 1, 1], [1, 1.3, 0.8], [1, 0.8, 1.6], [1, 1.2, 1.0], [1, 0.9, 0.7]])
    places = [[0, 0, 0], [2.2, 0.6, 0.4], [3.6, 2.4, 0.8], [5.2, 4.2, 0.4], [7.6, 4.0, 0]]
    return sm.Keyframes.parametrised(turns * sizes[:, None], places)


def upright(
    radii: ArrayLike, heights: ArrayLike, twists: ArrayLike, bends: ArrayLike = 0.0, drifts: ArrayLike = 0.0
) -> sm.Keyframes:
    """Sections by radius, height, twist about z and bend about y in degrees, and drift along x."""
    one = np.ones_like(radii, dtype=float)
    a, b, o = np.deg2rad(twists), np.deg2rad(bends) * one, 0 * one
    z = np.stack([np.stack([np.cos(a), -np.sin(a), o], -1), np.stack([np.sin(a), np.cos(a), o], -1)], axis=-2)
    z = np.concatenate([z, np.stack([o, o, one], -1)[:, None]], axis=1)
    y = np.stack([np.stack([np.cos(b), o, np.sin(b)], -1), np.stack([o, one, o], -1)], axis=-2)
    y = np.concatenate([y, np.stack([-np.sin(b), o, np.cos(b)], -1)[:, None]], axis=1)
    sizes = np.column_stack([radii, radii, one])
    places = np.column_stack([np.asarray(drifts) * one, o, heights])
    return sm.Keyframes.parametrised(y @ z * sizes[:, None], places, "chordal")


def vase() -> sm.Keyframes:
    return upright([0.75, 1.25, 1.35, 0.7, 0.5, 0.95], [0, 0.8, 1.7, 2.9, 3.6, 4.3], [0, 12, 25, 40, 50, 60])


def flower() -> sm.Keyframes:
    return upright(
        [0.1, 0.09, 0.12, 0.55, 1.35, 1.9],
        [0, 1.4, 2.6, 3.1, 3.35, 3.3],
        [0, 10, 20, 30, 45, 65],
        [0, 4, 14, 20, 22, 22],
        np.array([0, 0.03, 0.25, 0.45, 0.6, 0.65]),
    )


# name: keyframes, profile, view
SHAPES: dict[str, tuple[Callable[[], sm.Keyframes], sm.splines.Spline, np.ndarray]] = {
    "band": (band, wave(), BAND_VIEW),
    "vase": (vase, lobes(8, 0.06), ABOVE),
    "flower": (flower, lobes(5, 0.3), ABOVE),
}


def run(options: StudyOptions) -> StudyResult:
    runs: list[Run] = []
    rows: Rows = []
    nets: Rows = []
    areas: Rows = []
    surfaces: dict[str, dict[str, SweepSurface]] = {}
    players: list[Player] = []
    for name, (keyframes, profile, view) in SHAPES.items():
        options.progress(name)
        program = sm.affine_program(keyframes(), objective=OBJECTIVE, refine=3 if options.full else 1)
        comparison = sm.compare(program, [sm.ExactNewton(), sm.Ipopt()])
        runs += [Run.of(name, s) for s in comparison.solutions]
        if comparison.best is None:
            raise sm.SolveError(f"no solver solved {name}")
        surfaces[name] = {}
        carried = {"interpolating spline": start_of(program), "optimum": comparison.best.motion}
        caption = f"Before and after: the profile that sweeps the {name}. Grey: the keyframes."
        players.append(player(name, carried, [_outline(profile)], caption, keyframes(), direction=view[:, 2]))
        for kind, motion in carried.items():
            surface = surfaces[name][kind] = sweep_surface(motion, profile)
            measures = (sm.measure(motion, e) for e in (OBJECTIVE, RIGIDITY, PATHS))
            area = surface.mesh(160, 160).area
            rows.append((name, kind, *measures, area))
        nets.append((name, *_exactness(surfaces[name]["optimum"], comparison.best.motion, profile)))
        areas += _refinement(name, surfaces[name]["optimum"], (20, 40, 80, 160, 320) if options.full else (20, 40, 80))
    motions = Table(
        "motions",
        columns("surface", "motion", "R* + E / 100", "R*", "E", "area of the surface"),
        tuple(rows),
        "R*: how far the squared lengths and the products of the unit vectors are from changing linearly; E: the "
        "bending of the paths of four body points. The area is that of a mesh of 160 × 160 pieces.",
    )
    exact = Table(
        "control nets",
        columns(
            "surface",
            "net in u",
            "net in t",
            "degrees",
            "largest |S − (v + A C)|",
            "the same for S_ut",
            "size of the surface",
        ),
        tuple(nets),
        "The tensor-product spline with the net vⱼ + Aⱼcᵢ against the motion applied to the profile, at 41 × 41 "
        "parameters.",
    )
    refinement = Table(
        "meshes",
        columns("surface", "pieces along each side", "triangles", "area", "order"),
        tuple(areas),
        "Order: log₂ of the ratio of successive differences when the pieces are halved.",
    )
    figures = (_band(surfaces["band"]), _shapes(surfaces))
    less = [100 * (1 - b[3] / a[3]) for a, b in zip(rows[::2], rows[1::2], strict=True)]
    answer = (
        f"What a spline profile sweeps is one tensor-product spline, to {max(n[4] / n[6] for n in nets):.0e} of its "
        f"size; the optimum between the same sections has {min(less):.0f} to {max(less):.0f} % less R* than the spline."
    )
    tables, text = (motions, exact, refinement), _said(runs, rows, nets, areas)
    return StudyResult(tables, figures, tuple(runs), text, players=tuple(players), answer=answer)


def _outline(profile: sm.splines.Spline) -> np.ndarray:
    """A profile as a closed polygon, (N, 3); an open one goes there and back: without area, a line."""
    curve = profile(np.linspace(*profile.domain, 65))
    return curve if np.allclose(curve[0], curve[-1]) else np.concatenate([curve, curve[-2:0:-1]])


def _said(runs: list[Run], rows: Rows, nets: Rows, areas: Rows) -> str:
    error = max(n[4] / n[6] for n in nets)
    orders = [a[4] for a in areas if a[4] is not None]
    gains = [f"{a[0]} {a[3]:.4g} to {b[3]:.4g}" for a, b in zip(rows[::2], rows[1::2], strict=True)]
    certified = sum(r.certified for r in runs)
    return (
        f"The sweep of a spline profile under an affine spline motion is one tensor-product spline: its net "
        f"vⱼ + Aⱼcᵢ reproduces v + A C to {error:.1g} of the surface's size.\n\n"
        f"Between the same sections the optimum lowers R* against the interpolating spline: {', '.join(gains)}. "
        f"{certified} of {len(runs)} runs are certified. {where_solvers_end(runs)}\n\n"
        f"The areas of the meshes converge with orders {min(orders):.3g} to {max(orders):.3g}."
    )


def _exactness(surface: SweepSurface, motion: sm.AffineMotion, profile: sm.splines.Spline) -> tuple[Any, ...]:
    u, t = (np.linspace(a, b, 41) for a, b in surface.domain)
    (linear, translation), (rate, _) = motion(t), motion(t, 1)
    moved = translation + np.einsum("tij,uj->uti", linear, profile(u))
    mixed = np.einsum("tij,uj->uti", rate, profile(u, 1))
    n, m, _ = surface.control_points.shape
    size = float(np.ptp(moved.reshape(-1, 3), axis=0).max())
    away = float(np.abs(surface(u[:, None], t) - moved).max())
    return (
        n,
        m,
        f"{surface.u.degree} × {surface.t.degree}",
        away,
        float(np.abs(surface(u[:, None], t, (1, 1)) - mixed).max()),
        size,
    )


def _refinement(name: str, surface: SweepSurface, pieces: tuple[int, ...]) -> list[tuple[Any, ...]]:
    rows: list[tuple[Any, ...]] = []
    areas: list[float] = []
    for k in pieces:
        mesh = surface.mesh(k, k)
        areas.append(mesh.area)
        order = None if len(areas) < 3 else float(np.log2((areas[-2] - areas[-3]) / (areas[-1] - areas[-2])))
        rows.append((name, k, len(mesh.triangles), mesh.area, order))
    return rows


def _band(surfaces: dict[str, SweepSurface]) -> Figure:
    with new_figure(7.0, 2.2) as figure:
        for axes, (name, surface) in zip(figure.subplots(1, 2), surfaces.items(), strict=True):
            draw_mesh(axes, surface.mesh(60, 120), inside=COLOURS[0], view=BAND_VIEW)
            _draw_sections(axes, surface, band().times, BAND_VIEW)
            axes.set_title(name)
        return to_figure(
            figure,
            "band",
            "An open profile under an affine motion through five keyframes, in ink (HJK figure 6a).",
        )


def _shapes(surfaces: dict[str, dict[str, SweepSurface]]) -> Figure:
    with new_figure(7.0, 7.2) as figure:
        grid = figure.subplots(2, 2)
        for row, name in zip(grid, ("vase", "flower"), strict=True):
            view = SHAPES[name][2]
            for axes, (kind, surface) in zip(row, surfaces[name].items(), strict=True):
                draw_mesh(axes, surface.mesh(120, 90), view=view)
                axes.set_title(f"{name}, {kind}")
        return to_figure(
            figure,
            "vase-and-flower",
            "Closed profiles with eight and five lobes, swept to a vase and a flower (HJK figure 6b). Orange: the "
            "inside.",
        )


def _draw_sections(axes, surface: SweepSurface, times: np.ndarray, view: np.ndarray) -> None:
    u = np.linspace(*surface.u.domain, 200)
    for t in times:
        draw_curve(axes, surface(u, t), COLOURS[5], linewidth=1.2, view=view)


STUDY = Study(
    "sweep_surfaces",
    "Is the surface that a spline profile sweeps a spline, and what does optimisation change about it?",
    "HJK 5.4, figure 6",
    run,
    order=17,
)

"""A picture that moves: an SVG that plays by itself wherever pictures are shown, without a script."""

from collections.abc import Mapping, Sequence

import numpy as np

import symmotion as sm
from symmotion.report import Figure
from symmotion.views import COLOURS

STEPS = 48
SECONDS = 6.0
MARGIN, TITLE = 0.6, 0.9  # in units of length


def moving(
    name: str, motions: Mapping[str, sm.AffineMotion], body: Sequence[np.ndarray], keys: sm.Keyframes, caption: str
) -> Figure:
    """Planar motions side by side, each under its label: a body (polygons (P, 2)), the keyframes grey.

    The browser blends between 48 positions of each; who prefers less motion sees the body at rest.
    """
    times = np.linspace(keys.times[0], keys.times[-1], STEPS + 1)
    corners = np.concatenate(body)
    reached = np.concatenate([motion.trajectory(corners, times).reshape(-1, 2) for motion in motions.values()])
    low, high = reached.min(axis=0) - MARGIN, reached.max(axis=0) + MARGIN
    width, height = high - low
    shape = " ".join("M" + " ".join(f"{x:.3g},{y:.3g}" for x, y in polygon) + "Z" for polygon in body)
    styles, parts = [], []
    for k, (label, motion) in enumerate(motions.items()):
        linear, translation = motion(times)
        frames = "".join(
            f"{100 * i / STEPS:.4g}%{{transform:{_matrix(a, v)}}}"
            for i, (a, v) in enumerate(zip(linear, translation, strict=True))
        )
        played = f"animation:{name}-{k} {SECONDS:g}s linear infinite"
        styles.append(f"@keyframes {name}-{k}{{{frames}}}[id$={name}-b{k}]{{{played}}}")
        path = " ".join(f"{x:.3g},{y:.3g}" for x, y in translation)
        ghosts = "".join(
            f'<use href="#{name}-s" transform="{_matrix(a, v)}" fill="#8a929a" fill-opacity=".45"/>'
            for a, v in zip(keys.linear, keys.translation, strict=True)
        )
        # Up is up: the y-axis of SVG points down.
        parts.append(
            f'<g transform="translate({k * width - low[0]:.4g},{high[1] + TITLE:.4g}) scale(1,-1)">{ghosts}'
            f'<polyline points="{path}" fill="none" stroke="#8a929a" stroke-width=".05"/>'
            f'<use id="{name}-b{k}" href="#{name}-s" transform="{_matrix(linear[0], translation[0])}" '
            f'fill="{COLOURS[k]}" fill-opacity=".85"/></g>'
            f'<text x="{k * width + MARGIN:.4g}" y="{0.75 * TITLE:.4g}" font-size=".7" fill="#8a929a" '
            f'font-family="sans-serif">{label}</text>'
        )
    box = f"0 0 {len(motions) * width:.4g} {height + TITLE:.4g}"
    calm = f"@media (prefers-reduced-motion:reduce){{[id*={name}-b]{{animation:none!important}}}}"
    style = f"<style>{''.join(styles)}{calm}</style>"
    tall = 800 * (height + TITLE) / (len(motions) * width)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="800" height="{tall:.0f}"'
    return Figure(
        name,
        f'{head} viewBox="{box}">{style}<defs><path id="{name}-s" d="{shape}"/></defs>{"".join(parts)}</svg>\n',
        caption,
    )


def _matrix(linear: np.ndarray, translation: np.ndarray) -> str:
    (a, c), (b, d) = linear
    return f"matrix({a:.4g},{b:.4g},{c:.4g},{d:.4g},{translation[0]:.4g},{translation[1]:.4g})"

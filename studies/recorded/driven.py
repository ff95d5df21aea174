"""A car that rolls without slipping along roads drawn at random: what the energy of side-slip is worth. Material."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

import symmotion as sm
from studies.shares import ratio
from symmotion.motions import polar_factors
from symmotion.report import Column, Table
from symmotion.smoothing import rigid_objective

SECONDS, STEPS, POSES = 40.0, 4000, 401
WEIGHTS = (1.0, 10.0, 100.0)  # of ∫ slip² dt, over the square of the extent
SPACINGS = (10, 20)  # poses from keyframe to keyframe: 1 s and 2 s


def drive(seed: int) -> sm.Keyframes:
    """Ten poses a second in the plane, some 200 m: curvature and speed vary smoothly, the body looks ahead."""
    rng, t = np.random.default_rng(seed), np.linspace(0.0, SECONDS, STEPS + 1)
    curvature = np.interp(t, np.linspace(0.0, SECONDS, 14), 0.15 * rng.normal(size=14))
    speed = 5 + 2 * np.sin(0.5 * t + rng.uniform(0, 2 * np.pi))
    heading = np.cumsum(gaussian_filter1d(curvature, 60) * speed) * t[1]
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    places = np.cumsum(speed[:, None] * ahead, axis=0) * t[1]
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    every = STEPS // (POSES - 1)
    return sm.Keyframes(t[::every], np.stack([ahead, left], axis=2)[::every], places[::every])


def off(motion: sm.AffineMotion, truth: sm.Keyframes) -> tuple[float, float]:
    """Root mean square distance in m, and angle in rad."""
    linear, places = motion(truth.times)
    turned = np.swapaxes(truth.linear, 1, 2) @ polar_factors(linear)[0]
    angles = np.arctan2(turned[:, 1, 0], turned[:, 0, 0])
    return float(np.sqrt(((places - truth.translation) ** 2).sum(axis=1).mean())), float(np.sqrt((angles**2).mean()))


def table(roads: int) -> tuple[Table, float]:
    """Errors between keyframes over those without the energy, and the least of them in place."""
    rows, least = [], np.inf
    for every in SPACINGS:
        errors: dict[float, list[tuple[float, float]]] = {0.0: [], **{w: [] for w in WEIGHTS}}
        for seed in range(roads):
            truth = drive(seed)
            keys = truth[::every]
            size = ((keys.translation - keys.translation.mean(axis=0)) ** 2).sum(axis=1).mean()
            for weight, found in errors.items():
                objective: sm.energies.Energy = rigid_objective(keys)
                if weight:
                    objective = objective + weight / size * sm.energies.SideSlip((1.0, 0.0))
                program = sm.affine_program(keys, objective=objective)
                found.append(off(sm.ExactNewton().solve(program).require().motion, truth))
        plain = np.array(errors[0.0])
        for weight in WEIGHTS:
            mine = np.array(errors[weight])
            place, turn = (ratio(mine[:, k], plain[:, k]) for k in range(2))
            least = min(least, place[0])
            beside = (f"{middle:.2f} ({low:.2f}–{high:.2f})" for middle, low, high in (place, turn))
            rows.append((every / 10, (POSES - 1) // every + 1, float(plain[:, 0].mean()), weight, *beside))
    columns = (
        Column("interval", "s"),
        Column("keyframes"),
        Column("place, without", "m"),
        Column("weight of side-slip", "1/extent²"),
        Column("place, with / without"),
        Column("turn, with / without"),
    )
    caption = (
        f"A car that does not slip, between keyframes: `rigid_objective` with `SideSlip` beside it, over the former "
        f"alone; means of {roads} roads drawn at random, with 95 % intervals by the bootstrap."
    )
    return Table("a car", columns, tuple(rows), caption), least

"""How well a fit is known: its band by sensitivities, beside fits of samples drawn anew, and beside the truth."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import symmotion as sm
from studies.recorded.recorded_pair import Pair, load
from symmotion.answers import Band, FitCovariance, fit_covariance
from symmotion.motions import polar_factors
from symmotion.report import Column, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import new_figure

CONTROLS, TIMES, SEED = (20, 40), 40, 1


@dataclass(frozen=True, eq=False)
class Known:
    """A fit with its covariance and band, and the deviations (times,) of fits of samples drawn anew."""

    solution: sm.Solution
    covariance: FitCovariance
    band: Band
    place: np.ndarray
    turn: np.ndarray


def draws(solution: sm.Solution, sizes: tuple[float, float], band: Band, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Root mean square deviations (times,) of places and turns of `count` fits of the fitted samples with new noise."""
    samples, rng = solution.program.design.samples, np.random.default_rng(SEED)
    linear, translation = solution.motion(samples.times)
    own = Rotation.from_matrix(polar_factors(linear)[0])
    clean = sm.ExactNewton().solve(
        solution.program.with_keyframes(sm.Keyframes(samples.times, own.as_matrix(), translation))
    )
    middle, there = clean.motion(band.times)
    before = Rotation.from_matrix(polar_factors(middle)[0]).inv()
    place, turn = np.zeros(len(band.times)), np.zeros(len(band.times))
    for _ in range(count):
        spun = Rotation.from_rotvec(sizes[1] * rng.normal(size=(len(samples), 3))) * own
        shifted = translation + sizes[0] * rng.normal(size=translation.shape)
        drawn = sm.Keyframes(samples.times, spun.as_matrix(), shifted)
        found = sm.ExactNewton().solve(solution.program.with_keyframes(drawn), start=clean).motion
        a, v = found(band.times)
        place += ((v - there) ** 2).sum(axis=1) / count
        turn += (Rotation.from_matrix(polar_factors(a)[0]) * before).magnitude() ** 2 / count
    return np.sqrt(place), np.sqrt(turn)


def known(pair: Pair, controls: int, count: int) -> Known:
    """The fit of the recording with a number of controls."""
    solution = sm.ExactNewton().solve(sm.fit_program(pair.estimate, controls=controls)).require()
    covariance = fit_covariance(solution)
    assert covariance.sizes is not None  # they were estimated
    band = covariance.band(TIMES)
    return Known(solution, covariance, band, *draws(solution, covariance.sizes, band, count))


def covered(pair: Pair, band: Band) -> float:
    """The share of the band's places that are within two standard deviations of the truth, coordinate by coordinate."""
    truth = np.stack([np.interp(band.times, pair.truth.times, c) for c in pair.truth.translation.T], axis=1)
    deviations = np.sqrt(np.diagonal(band.places, axis1=1, axis2=2))
    return float((np.abs(truth - band.positions.translation) <= 2 * deviations).mean())


def run(options: StudyOptions) -> StudyResult:
    pair, count = load(), 1000 if options.full else 20
    found: dict[int, Known] = {}
    for controls in CONTROLS:
        options.progress(f"{controls} controls, {count} fits of new samples")
        found[controls] = known(pair, controls, count)
    rows = []
    for controls, k in found.items():
        place, turn = k.covariance.sizes or (np.nan, np.nan)
        rows.append(
            (
                controls,
                1e3 * place,
                float(np.rad2deg(turn)),
                1e3 * _mean(k.band.place),
                float(np.rad2deg(_mean(k.band.turn))),
                _mean(k.place) / _mean(k.band.place),
                _mean(k.turn) / _mean(k.band.turn),
                100 * covered(pair, k.band),
            )
        )
    columns = (
        Column("controls"),
        Column("σ of a place", "mm"),
        Column("σ of a turn", "°"),
        Column("place known to", "mm"),
        Column("turn known to", "°"),
        Column("place, drawn / predicted"),
        Column("turn, drawn / predicted"),
        Column("truth within 2σ", "%"),
    )
    caption = (
        "σ: of each coordinate of a sample, from what the fit leaves; known to: root mean square over the motion, by "
        f"sensitivities; drawn: {count} fits (seed {SEED}) of samples about the fit with noise of this σ."
    )
    with new_figure(7.0, 3.4) as figure:
        found[CONTROLS[-1]].band.plot(figure.add_subplot())
        drawn = to_figure(figure, "band", f"The fit with {CONTROLS[-1]} controls, two standard deviations wide.")
    runs = tuple(Run.of(f"{controls} controls", k.solution) for controls, k in found.items())
    off = max(max(abs(row[5] - 1), abs(row[6] - 1)) for row in rows)
    interval = 2 / np.sqrt(2 * count * 3)
    conclusion = (
        f"Bands by sensitivities and {count} fits of new samples differ by at most {100 * off:.2g} %, where the draws "
        f"alone leave some {100 * interval:.0f} % at a single time. Of the true places {rows[0][7]:.0f} % and "
        f"{rows[-1][7]:.0f} % are within two deviations: the band knows the noise, not what so few controls cannot "
        "follow, or what is off for long."
    )
    answer = (
        f"The band of a fit, by its sensitivities, is that of {count} fits of new samples to {100 * off:.2g} % (chance "
        f"alone moves these by some {100 * interval:.0f} %), and holds {rows[0][7]:.0f} to {rows[-1][7]:.0f} % of the "
        "truth within 2σ."
    )
    tables = (Table("band", columns, tuple(rows), caption),)
    return StudyResult(tables, (drawn,), runs, conclusion, (pair.note,), answer=answer)


def _mean(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


STUDY = Study(
    "covariance",
    "How well is a motion known that was fitted to noisy samples?",
    "HJK 2.3; first-order covariance by the sensitivities of the fit",
    run,
    order=12,
)

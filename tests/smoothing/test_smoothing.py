"""Recordings to motions: the noise that was added is found, and the truth met as closely as SciPy's smoothers do."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from noise import PLACE, TURN, deviations, noisy, of_motion, swing
from scipy.interpolate import BSpline, make_smoothing_spline
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.design.amounts import controls_of
from symmotion.design.fit_space import fit_basis
from symmotion.smoothing import amount, plan
from symmotion.splines import BSplineBasis, Spline

RECORDED = Path(__file__).resolve().parents[3] / "shared" / "data" / "freiburg1_xyz-groundtruth.txt"


def in_line(rotations: Rotation) -> np.ndarray:
    """Quaternions, neighbours on one side."""
    q = rotations.as_quat()
    return q * np.cumprod(np.concatenate([[1], np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1, 1)]))[:, None]


def of_splines(truth: sm.Keyframes, samples: sm.Keyframes) -> np.ndarray:
    """SciPy's smoothing splines, which choose by cross-validation coordinate by coordinate."""
    t = samples.times - samples.times[0]
    places = np.stack([make_smoothing_spline(t, x)(t) for x in samples.translation.T], axis=1)
    turns = np.stack([make_smoothing_spline(t, x)(t) for x in in_line(samples.rotations()).T], axis=1)
    return deviations(truth, Rotation.from_quat(turns), places)


def of_windows(truth: sm.Keyframes, samples: sm.Keyframes) -> np.ndarray:
    """The best Savitzky-Golay window for each of place and turn, told by the truth."""
    q, found = in_line(samples.rotations()), []
    for order in (2, 3, 4):
        for window in range(order + 2 + order % 2, min(121, len(q)), 4):
            window += 1 - window % 2
            turns = Rotation.from_quat(savgol_filter(q, window, order, axis=0))
            found.append(deviations(truth, turns, savgol_filter(samples.translation, window, order, axis=0)))
    return np.min(found, axis=0)


@pytest.mark.parametrize("noise", [None, (PLACE, TURN)])
def test_as_close_to_the_truth_as_smoothing_splines(noise):
    truth = swing(100)
    ratios = []
    for seed in range(3):
        samples = noisy(truth, seed)
        ratios.append(of_motion(truth, sm.smooth(samples, noise=noise).motion) / of_splines(truth, samples))
    assert (np.mean(ratios, axis=0) <= 1.0).all()


@pytest.mark.skipif(not RECORDED.is_file(), reason="the recording is not beside the checkout")
def test_a_recording_with_noise_put_on():
    truth = sm.read_keyframes(RECORDED)[::6]
    samples = noisy(truth, 1)
    ours = of_motion(truth, sm.smooth(samples).motion)
    assert (ours <= of_windows(truth, samples)).all()
    assert (ours <= [1.0, 1.02] * of_splines(truth, samples)).all()


@pytest.mark.skipif(not RECORDED.is_file(), reason="the recording is not beside the checkout")
def test_a_recording_of_few_poses_a_second():
    """Five a second of a camera held by hand: controls fewer than poses were off by 1.5 and 1.2 times SciPy's error."""
    truth, off = sm.read_keyframes(RECORDED)[::20], []
    for seed in range(3):
        samples = noisy(truth, seed, (0.0005, 0.005))
        off.append(of_motion(truth, sm.smooth(samples).motion) / of_splines(truth, samples))
    assert (np.mean(off, axis=0) <= 1.03).all()


def test_the_noise_is_found_and_said():
    made = plan(noisy(swing(400), 3))
    assert made.noise is not None and made.noise == pytest.approx((PLACE, TURN), rel=0.1)
    place, turn = made.notes[1:3]
    assert f"σ = {made.noise[0]:.3g} left" in place and f"σ = {made.noise[1]:.3g} rad left" in turn
    assert "smoothed by generalised cross-validation" in made.notes[0]
    assert made.program.notes == made.notes and "by the noise given" in plan(swing(40), noise=(0.1, 0.1)).notes[0]
    assert plan(swing(40), noise=0).noise is None


def shaken(count: int, jolt: float) -> sm.Keyframes:
    """A body whose accelerations are independent from pose to pose: what poses so far apart can just tell."""
    x = np.cumsum(np.cumsum(jolt * np.random.default_rng(5).normal(size=(count, 6)), axis=0), axis=0)
    x = x - np.linspace(0, 1, count)[:, None] * x[-1]
    return sm.Keyframes(0.1 * np.arange(count), Rotation.from_rotvec(0.2 * x[:, :3]).as_matrix(), x[:, 3:])


def test_a_motion_that_takes_most_degrees_of_freedom_is_not_taken_for_noise():
    """As fewer controls than samples take it: then places were off by 1.3 times the noise, and more than SciPy's."""
    truth, found, off = shaken(60, 0.04), [], []
    for seed in range(4):
        samples = noisy(truth, seed)
        made = plan(samples)
        assert made.program.design.basis.n == 60
        found.append(made.noise)
        off.append(of_motion(truth, made.solve().motion) / of_splines(truth, samples))
    assert (np.mean(off, axis=0) < 1.02).all()
    assert np.mean(found, axis=0)[0] < 1.6 * PLACE
    unsure = plan(noisy(shaken(60, 0.4), 0)).notes[1]
    assert unsure.endswith(", which leaves little to tell noise by: give it where it is known")
    assert not any("give it" in note for note in plan(noisy(swing(100), 0)).notes)


def test_with_a_knot_at_every_sample_it_is_the_smoothing_spline():
    """SciPy's for the same weight, and its trace by the values of splines of unit vectors."""
    rng = np.random.default_rng(4)
    t = np.sort(rng.uniform(0, 3, 40)) + 100.0
    values, basis = rng.normal(size=(40, 2)), BSplineBasis.clamped(t, 3)
    noisy_line = amount(basis, t, values, 2)
    assert 2 <= noisy_line.freedom < 10
    for weight in (1e-7, 1e-3, 1.0, 100.0):
        chosen = replace(noisy_line, weight=weight)
        found = Spline(basis, controls_of(basis, t, values, chosen))
        expected = make_smoothing_spline(t - 100, values, lam=weight)
        np.testing.assert_allclose(found(t), expected(t - 100), atol=1e-7)
        np.testing.assert_allclose(found(t, 1), expected(t - 100, 1), atol=1e-4)
    wave = np.sin(3 * t)[:, None] + 0.01 * values
    for sigma in (0.01, None):
        chosen = amount(basis, t, wave, 2, sigma)
        trace = np.trace(make_smoothing_spline(t - 100, np.eye(40), lam=chosen.weight)(t - 100))
        assert chosen.freedom == pytest.approx(trace, rel=1e-3)


def test_the_weight_is_that_of_least_cross_validation():
    """Against the definition, with dense matrices: no weight near has a smaller score, and the trace is the trace."""
    t = np.sort(np.random.default_rng(1).uniform(0, 3, 40))
    values = np.stack([np.sin(2 * t), t**2], axis=1) + 0.1 * np.random.default_rng(2).normal(size=(40, 2))
    for order in (2, 3):
        basis = fit_basis(t, np.arange(40), 2 * order - 1, 30, None)
        design = BSpline.design_matrix(t, basis.knots, basis.degree).toarray()
        x = np.linspace(*basis.domain, 40_001)
        rates = np.stack([BSpline(basis.knots, c, basis.degree)(x, order) for c in np.eye(basis.n)], axis=1)
        penalty = (
            rates.T @ rates * (x[1] - x[0])
            - (np.outer(rates[0], rates[0]) + np.outer(rates[-1], rates[-1])) * (x[1] - x[0]) / 2
        )

        def score(weight, design=design, penalty=penalty):
            hat = design @ np.linalg.solve(design.T @ design + weight * penalty, design.T)
            left = ((values - hat @ values) ** 2).sum()
            return left / (40 - np.trace(hat)) ** 2, np.trace(hat)

        found = amount(basis, t, values, order)
        assert found.freedom == pytest.approx(score(found.weight)[1], rel=1e-3)
        scores = [score(found.weight * factor)[0] for factor in (0.5, 1.0, 2.0)]
        assert scores[1] < min(scores[0], scores[2])


def test_place_and_turn_are_smoothed_apart():
    """Jerky places and a calm turn: neither takes the other's weight, nor its unit."""
    truth = swing(200)
    jerky = truth.translation + 0.3 * np.sin(25 * truth.times)[:, None]
    samples = noisy(sm.Keyframes(truth.times, truth.linear, jerky), 0)
    motion = sm.smooth(samples).motion
    alone = sm.smooth(noisy(truth, 0)).motion
    turn = of_motion(sm.Keyframes(truth.times, truth.linear, jerky), motion)
    assert turn[1] == pytest.approx(of_motion(truth, alone)[1], rel=0.02) and turn[0] < 2.0 * PLACE
    large = sm.Keyframes(samples.times, samples.linear, 1000 * samples.translation)
    np.testing.assert_allclose(
        sm.smooth(large).motion(truth.times).translation, 1000 * motion(truth.times).translation, atol=1e-3
    )


def test_without_noise_the_motion_passes_through_all():
    keys = swing(12)
    solution = sm.smooth(keys, noise=0)
    assert "of least R and a little of how place and turn bend" in plan(keys, noise=0).notes[0]
    np.testing.assert_allclose(solution.motion(keys.times).linear, keys.linear, atol=1e-8)
    np.testing.assert_allclose(solution.motion(keys.times).translation, keys.translation, atol=1e-8)
    affine = sm.examples.planar_keyframes()
    assert f"a motion through all {len(affine)} keyframes, of least R + 0.0111 E" in plan(affine, noise=0).notes[0]
    np.testing.assert_allclose(sm.smooth(affine, noise=(0, 0)).motion(affine.times).linear, affine.linear, atol=1e-8)
    few = plan(swing(5))
    assert "5 keyframes are too few to tell noise from motion: they are interpolated" in few.notes


def test_planar_and_affine_recordings():
    t = np.linspace(0, 3, 60)
    linear = np.stack([sm.examples.rotation_2d(40 * x) for x in t])
    rng = np.random.default_rng(0)
    samples = sm.Keyframes(t, linear + 0.01 * rng.normal(size=linear.shape), 0.02 * rng.normal(size=(60, 2)))
    solution = sm.smooth(samples)
    assert solution.status == "solved" and np.abs(solution.motion(t).linear - linear).max() < 0.03


def test_a_path_is_read_with_what_is_said(tmp_path):
    keys = noisy(swing(40), 0)
    sm.write_keyframes(keys, tmp_path / "a.csv")
    one, other = sm.smooth(tmp_path / "a.csv"), sm.smooth(keys)
    assert one.objective == other.objective
    text = (tmp_path / "a.csv").read_text().splitlines()
    (tmp_path / "b.csv").write_text("\n".join(line + f",{k if k else 'index'}" for k, line in enumerate(text)))
    assert plan(tmp_path / "b.csv").notes[0] == "columns that are no part of a pose are left out: index"


@pytest.mark.parametrize("noise", [-1, (1,), (1, -1), "much", (np.nan, 1), (0, 1), True])
def test_bad_noise(noise):
    with pytest.raises(sm.InputError, match="noise"):
        sm.smooth(swing(20), noise=noise)


def test_a_recording_that_stands_still():
    still = sm.Keyframes(np.arange(20.0), np.tile(np.eye(3), (20, 1, 1)), np.ones((20, 3)))
    np.testing.assert_allclose(sm.smooth(still).motion([3.3, 7.7]).translation, 1, atol=1e-9)


@pytest.mark.parametrize("where", [0, 30, 58])
def test_stamps_that_agree_up_to_rounding(where):
    """Two poses at one time have one knot, at the ends as well, and what is left is of the size of the noise."""
    samples = noisy(swing(60), 0)
    t = samples.times + 1.3e9
    t[where + 1] = np.nextafter(t[where], np.inf)
    solution = sm.smooth(sm.Keyframes(t, samples.linear, samples.translation))
    off = solution.motion(t).translation - samples.translation
    assert solution.certified and np.sqrt((off**2).sum(axis=1).mean()) < 2 * np.sqrt(3) * PLACE

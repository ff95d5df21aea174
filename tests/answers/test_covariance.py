"""How well fits are known, against fits of samples drawn anew and against linear regression."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.answers import fit_covariance, noise_of
from symmotion.motions import polar_factors

T = np.linspace(0, 4, 40)
TURNS = Rotation.from_rotvec(np.stack([np.sin(T), 0.5 * T, np.cos(0.7 * T)], axis=1))
PLACES = np.stack([T, np.sin(T), np.cos(T)], axis=1)
CLEAN = sm.Keyframes(T, TURNS.as_matrix(), PLACES)
SIZES = (0.03, 0.02)
SOLVER = sm.ExactNewton(kernels="interpreted")


def noisy(rng: np.random.Generator) -> sm.Keyframes:
    spun = Rotation.from_rotvec(SIZES[1] * rng.normal(size=(len(T), 3))) * TURNS
    return sm.Keyframes(T, spun.as_matrix(), PLACES + SIZES[0] * rng.normal(size=PLACES.shape))


def test_bands_are_those_of_fits_of_samples_drawn_anew():
    program = sm.fit_program(CLEAN, controls=10, objective=1e-3 * sm.Rigidity(), exact=[20])
    solution = SOLVER.solve(program).require()
    band = fit_covariance(solution, SIZES).band(9)
    before, rng, count = (
        Rotation.from_matrix(polar_factors(band.positions.linear)[0]).inv(),
        np.random.default_rng(0),
        150,
    )
    place, turn = np.zeros(9), np.zeros(9)
    for _ in range(count):
        linear, translation = SOLVER.solve(program.with_keyframes(noisy(rng)), start=solution).motion(band.times)
        place += ((translation - band.positions.translation) ** 2).sum(axis=1) / count
        turn += (Rotation.from_matrix(polar_factors(linear)[0]) * before).magnitude() ** 2 / count
    # Each mean square has 3 · 150 numbers: four standard deviations are 4 √(2/450) of it.
    np.testing.assert_allclose(place / band.place**2, 1, atol=4 * np.sqrt(2 / (3 * count)))
    np.testing.assert_allclose(turn / band.turn**2, 1, atol=4 * np.sqrt(2 / (3 * count)))


def test_least_squares_have_the_covariance_of_regression():
    solution = SOLVER.solve(sm.fit_program(CLEAN, controls=8)).require()
    design = solution.program.design
    basis = design.basis(T)
    hat = np.linalg.inv(basis.T @ basis)
    times = np.array([0.0, 1.3, 4.0])
    rows = design.basis(times)
    covariances = fit_covariance(solution, np.diag([1.0] * 9 + [4.0] * 3)).coordinates(times)
    wanted = np.einsum("na,ab,nb->n", rows, hat, rows)
    np.testing.assert_allclose(covariances, wanted[:, None, None] * np.diag([1.0] * 9 + [4.0] * 3), atol=1e-10)
    gradient = np.zeros((2, solution.program.unknowns))
    gradient[0].reshape(8, 12)[3, 9] = gradient[1].reshape(8, 12)[4, 9] = 1.0
    found = fit_covariance(solution, (2.0, 0.0)).of(gradient)
    np.testing.assert_allclose(found, 4 * hat[3:5, 3:5], atol=1e-10)
    assert fit_covariance(solution, (2.0, 0.0)).of(gradient[0]) == pytest.approx(found[0, 0])


@pytest.mark.parametrize("weight", [0.0, 1e-2])
def test_noise_is_told_from_what_is_left(weight):
    objective = weight * sm.Rigidity(2) if weight else None
    found = []
    for seed in range(6):
        program = sm.fit_program(noisy(np.random.default_rng(seed)), controls=12, objective=objective)
        found.append(noise_of(SOLVER.solve(program).require()))
    place, turn = np.sqrt((np.array(found) ** 2).mean(axis=0))
    assert place == pytest.approx(SIZES[0], rel=0.1)
    assert turn == pytest.approx(SIZES[1], rel=0.1)


def test_plane_and_pictures():
    angle = 0.5 * T
    linear = np.stack([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)
    solution = SOLVER.solve(sm.fit_program(sm.Keyframes(T, linear, PLACES[:, :2]), controls=8)).require()
    band = fit_covariance(solution, (0.1, 0.02)).band([0.0, 2.0])
    assert band.turns.shape == (2, 1, 1)
    basis = solution.program.design.basis
    values = basis([0.0, 2.0])
    share = np.sqrt(np.einsum("na,ab,nb->n", values, np.linalg.inv(basis(T).T @ basis(T)), values))
    np.testing.assert_allclose(band.place, 0.1 * np.sqrt(2) * share, rtol=1e-6)
    axes = solution.plot(Figure().add_subplot(), kind="band")
    assert axes.get_ylabel() == "place"
    assert len(axes.lines) == 3


def test_what_is_refused():
    with pytest.raises(sm.InputError, match="the solution of a fit_program is needed"):
        fit_covariance(SOLVER.solve(sm.affine_program(sm.examples.planar_keyframes())))
    solution = SOLVER.solve(sm.fit_program(CLEAN, controls=8)).require()
    with pytest.raises(sm.InputError, match="standard deviations, 0 or more"):
        fit_covariance(solution, (-1.0, 0.1))
    with pytest.raises(sm.InputError, match=r"noise of shape \(3,\)"):
        fit_covariance(solution, [1.0, 2.0, 3.0])

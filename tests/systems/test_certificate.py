"""Certificates: points that are minima pass, and a thousand and more that only look like some are refused."""

import numpy as np
import pytest

import symmotion as sm

COUNT = 40  # programs of a kind, and five or six forgeries of each
TOLERANCE = 1e-8
RNG = np.random.default_rng(11)
E2 = 0.1 * sm.TrajectoryEnergy(np.eye(2))


def planar(seed: int) -> sm.Keyframes:
    return sm.examples.random_keyframes(4, 40, seed=seed)


def affine(seed, **options):
    keys = planar(seed)
    both = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(np.eye(keys.dimension))
    return sm.affine_program(keys, **{"objective": both, **options})


def orientation(seed, **options):
    rng = np.random.default_rng(seed)
    turns = sm.quaternions.exp(0.4 * rng.normal(size=(4, 3)))
    return sm.orientation_program(np.arange(4.0), turns, **options)


def pose(seed):
    turns = orientation(seed).design.keys.quaternions
    places = np.random.default_rng(seed).normal(size=(4, 3))
    both = sm.Torque() + sm.TrajectoryEnergy(np.eye(3))
    return sm.pose_program(np.arange(4.0), turns, places, objective=both)


def curve(seed):
    points = np.random.default_rng(seed).normal(size=(5, 2))
    return sm.curve_program([sm.constraints.CurveCondition.at(np.arange(5.0), points)])


def fit(seed):
    return sm.fit_program(sm.examples.random_keyframes(12, 10, seed=seed), controls=6, objective=1e-3 * sm.Rigidity())


def bounded(seed):
    """A speed bound that presses: a little below the fastest of what is not bounded."""
    plain = affine(seed)
    motion = sm.ExactNewton().solve(plain).motion
    tip = np.zeros(motion.dimension)
    fast = np.linalg.norm(motion.trajectory(tip, np.linspace(*motion.domain, 50), 1), axis=-1).max()
    return affine(seed, constraints=[sm.SpeedBound(tip, 0.97 * float(fast))])


def linear_bound(seed):
    """A plane that a coordinate of the path may not pass."""
    motion = sm.ExactNewton().solve(affine(seed)).motion
    path = motion(np.linspace(*motion.domain, 50)).translation[:, 0]
    most = 0.5 * (path.max() + motion(motion.breakpoints[::2]).translation[:, 0].max())
    wall = sm.JetConstraint(lambda jet: jet.v[0], lower=-np.inf, upper=float(most), name="wall")
    return affine(seed, constraints=[wall])


NEWTON, IPOPT = sm.ExactNewton(), sm.Ipopt()
KINDS = {
    "R and E": (affine, NEWTON),
    "R*": (lambda seed: affine(seed, objective=sm.Rigidity(2), degree=4), NEWTON),
    "unit volume": (lambda seed: affine(seed, constraints=[sm.constraints.UnitVolume([0.4])]), NEWTON),
    "orientation": (orientation, NEWTON),
    "pose": (pose, NEWTON),
    "curve": (curve, NEWTON),
    "fit": (fit, NEWTON),
    "speed bound": (bounded, IPOPT),
    "wall": (linear_bound, IPOPT),
    "S": (lambda seed: affine(seed, objective=sm.StrainRate() + E2 if planar(seed).dimension == 2 else None), NEWTON),
}


def along(program, solution) -> np.ndarray:
    """(unknowns,) a random change of the point, of the size of the unknowns, that keeps what is met to first order."""
    pressing = np.abs(solution.multiplier_vector) > 1e-4 * np.abs(solution.multiplier_vector).max(initial=0.0)
    met = np.flatnonzero((program.lower == program.upper) | pressing)
    jacobian = sm.program.Evaluator(program).jacobian(solution.x)[met].toarray()
    step = program.unit * RNG.normal(size=program.unknowns)
    return step - np.linalg.lstsq(jacobian, jacobian @ step, rcond=None)[0] if len(jacobian) else step


# Kinds whose programs take long to build.
SLOW = {"orientation": 8, "pose": 4, "unit volume": 15, "speed bound": 10, "wall": 15}


def forgeries(program, solution):
    """What looks like the solution but is no minimum: the point or its multipliers, and in what it is wrong."""
    x, multipliers = solution.x, solution.multiplier_vector
    yield x + 1e-4 * along(program, solution), multipliers
    yield x + 1e-6 * along(program, solution), multipliers
    if not len(multipliers):
        return
    yield x + 1e-6 * program.unit * RNG.normal(size=len(x)), multipliers
    yield x, multipliers * (1 + 1e-5 * RNG.normal(size=len(multipliers)))
    yield x, -multipliers
    for k in np.flatnonzero((program.lower < program.upper) & (multipliers == 0.0))[:1]:
        # A bound that is not met presses.
        pressed = multipliers.copy()
        pressed[k] = np.abs(multipliers).max() or 1.0
        yield x, pressed


@pytest.mark.parametrize("kind", KINDS)
def test_minima_pass_and_what_only_looks_like_one_is_refused(kind):
    make, solver = KINDS[kind]
    for seed in range(SLOW.get(kind, COUNT)):
        solution = solver.solve(make(seed)).require(TOLERANCE)
        program = solution.program  # with the times of its bounds at the end
        assert sm.certify(program, solution.x, solution.multiplier_vector) == solution.certificate
        for k, (x, multipliers) in enumerate(forgeries(program, solution)):
            assert not sm.certify(program, x, multipliers).holds(TOLERANCE), (seed, k)


def test_a_saddle_point_is_told_whoever_ends_there():
    """Turns by +180° and −180° are alike, so among motions that only scale the best one is stationary: a saddle."""
    keys = sm.Keyframes([0.0, 1.0], [np.eye(2), -np.eye(2)])
    solution = sm.solvers.Elimination().solve(sm.affine_program(keys, refine=0, objective=sm.Rigidity(2)))
    assert (solution.status, solution.inertia) == ("saddle", "indefinite")
    assert solution.certificate.stationary(TOLERANCE) and not solution.certificate.holds(TOLERANCE)


def test_a_hessian_that_is_zero_is_flat_and_the_point_a_minimum():
    keys = sm.Keyframes(np.arange(4.0), np.tile(np.eye(2), (4, 1, 1)), RNG.normal(size=(4, 2)))
    solution = NEWTON.solve(sm.affine_program(keys, degree=1, objective=E2)).require()
    assert (solution.inertia, solution.objective) == ("flat", 0.0)


def test_a_straight_motion_is_solved_where_nothing_but_rounding_is_left():
    keys = sm.examples.random_keyframes(2, 20, seed=1)
    for unit in (1e-9, 1e-2, 1.0, 1e9):
        quick = sm.Keyframes(unit * keys.times, keys.linear, keys.translation)
        energy = sm.TrajectoryEnergy(np.vstack([np.zeros(keys.dimension), np.eye(keys.dimension)]))
        solution = NEWTON.solve(sm.affine_program(quick, objective=energy)).require()
        assert solution.inertia == "positive"


def test_a_sign_is_wrong_on_one_side_only():
    """min (x − 1)² from 0 to 2, with x ≤ 1.5: neither bound presses; from there on none may."""
    program = affine(0, constraints=[sm.JetConstraint(lambda jet: jet.v[0], lower=-100.0, upper=100.0, name="wide")])
    solution = IPOPT.solve(program).require()
    multipliers = solution.multiplier_vector.copy()
    for value in (1.0, -1.0):
        multipliers[-1] = value
        certificate = sm.certify(solution.program, solution.x, multipliers)
        assert not certificate.holds(TOLERANCE) and certificate.pressing > 0.1

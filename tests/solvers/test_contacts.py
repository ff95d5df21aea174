"""Contacts: Newton's method finds times, motion and multipliers together, kinks and ends stay, and one time is left."""

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from studies.solving.bounded_problems import problem
from symmotion.solvers.contacts import Contacts, sides_of, together
from symmotion.solvers.exchanging import bounds_everywhere
from symmotion.solvers.reduced import Reduced

KEYS = sm.examples.random_keyframes(5, 60, 1)
TIP = np.array([0.3, 0.0, 0.1])
SMOOTH = sm.JetEnergy(lambda jet: ca.vertcat(ca.vec(jet.ddA), jet.ddv), squares=True, label="bends")


def limited(share):
    free = sm.ExactNewton().solve(sm.affine_program(KEYS, objective=SMOOTH)).motion
    t = np.linspace(*free.domain, 2001)
    most = float(np.linalg.norm(free.trajectory(TIP, t, 1)[:, 0], axis=1).max())
    return sm.affine_program(KEYS, objective=SMOOTH, constraints=[sm.SpeedBound(TIP, share * most)]), share * most


def test_contacts_settle_where_the_speed_is_at_its_maximum_and_at_its_limit():
    program, limit = limited(0.97)
    t = np.linspace(KEYS.times[0], KEYS.times[-1], 40)
    held = sm.ExactNewton()._at_times(program.with_times({"speed": t}), None)
    loads = held.multipliers["speed"][:, 0]
    heaviest = int(np.argmax(loads))
    contacts = Contacts.joined([("speed", t[heaviest], 0, loads.sum())])
    found = Reduced(program, bounds_everywhere(program)).settled(
        held.x, held.program.split(held.multiplier_vector), contacts
    )
    assert found is not None
    motion = program.design.motion(program.unpack(found.x))
    velocity, acceleration = (motion.trajectory(TIP, found.contacts.times, k)[:, 0] for k in (1, 2))
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), limit, rtol=1e-7)
    # d‖v‖²/dt = 2 v · a, of which differences tell some seven digits.
    slope = np.abs((velocity * acceleration).sum(axis=1))
    assert (slope < 1e-5 * np.linalg.norm(velocity, axis=1) * np.linalg.norm(acceleration, axis=1)).all()


@pytest.mark.parametrize("seed", [20, 53, 75, 81])
def test_every_time_that_is_left_presses(seed):
    """Curves with contacts at kinks and two about a knot; one that keeps out of a ball."""
    found = sm.ExactNewton(kernels="interpreted").solve(problem(seed).program).require(1e-8)
    assert found.exchange is not None and found.exchange.holds
    (name,) = bounds_everywhere(found.program)
    loads = found.program.split(found.multiplier_vector)[name]
    assert (np.abs(loads).max(axis=1) > 1e-6 * np.abs(loads).max()).all()
    times = np.asarray(found.program.constraint(name).times)[:, 0]
    assert (np.diff(times) > 1e-3 * np.ptp(KEYS.times)).all()


def test_the_optimum_is_that_of_many_fixed_times():
    program = problem(20).program
    found = sm.ExactNewton(kernels="interpreted").solve(program)
    (name,) = bounds_everywhere(program)
    everywhere = program.constraint(name).everywhere
    assert everywhere is not None
    marks = everywhere.breaks()
    times = np.linspace(marks[0], marks[-1], 301)
    fixed = sm.Ipopt()._at_times(program.with_times({name: times}), None).require(1e-7)
    assert fixed.objective <= found.objective * (1 + 1e-9)
    assert found.objective == pytest.approx(fixed.objective, rel=1e-3)


def test_a_time_at_a_kink_or_an_end_stays_while_the_excess_falls_on_its_inner_sides():
    breaks, spans = np.array([0.0, 1.0, 2.0]), np.ones(4)
    about = 1e-4 * np.arange(-2, 3)
    kink, slope = -np.abs(about), about
    excess = np.array([kink, slope, slope, -slope])
    side, free = sides_of(np.array([1.0, 1.0, 2.0, 0.5]), spans, breaks, excess)
    assert free.tolist() == [False, True, False, True]
    # The rise leads to the right of the knot; inside a span both sides serve.
    assert side[1] == 2 and side[3] == 1


def test_contacts_of_a_component_keep_their_order():
    contacts = Contacts.joined([("speed", 1.0, 0, 1.0), ("speed", 1.1, 0, 1.0), ("speed", 1.05, 1, 1.0)])
    moves = np.where(contacts.times < 1.05, 0.2, np.where(contacts.times > 1.05, -0.2, 0.0))
    share = together(contacts, moves)
    after = contacts.times + share * moves
    first = contacts.components == 0
    assert 0 < share < 1 and np.diff(after[first])[0] > 0
    assert together(contacts, 0.1 * moves) == 1.0


def test_held_times_carry_the_loads_of_all_components():
    contacts = Contacts.joined([("a", 2.0, 0, 1.0), ("a", 1.0, 1, -3.0), ("b", 1.0, 0, 5.0), ("a", 2.0, 1, 4.0)])
    times, loads = contacts.held("a", 2, 2)
    np.testing.assert_array_equal(times, [[1.0, 1.0], [2.0, 2.0]])
    np.testing.assert_array_equal(loads, [[0.0, -3.0], [1.0, 4.0]])
    assert len(contacts.with_more([contacts.of(contacts.bounds == "b")]).times) == 5


def test_two_maxima_beside_a_knot_are_both_found():
    """3 τ² − 100 |τ|³, with maxima 0.02 before and after a knot at τ = 0, closer than the samples of a span are."""
    basis = sm.splines.BSplineBasis.clamped(np.array([0.0, 1.0, 2.0]), 3)
    t = np.linspace(0, 2, 21)
    x = 3 * (t - 1) ** 2 - 100 * np.abs(t - 1) ** 3
    controls = np.linalg.lstsq(basis.matrix(t).toarray(), np.stack([x, t], axis=1))[0]
    points = np.stack([t, t], axis=1)[::10]
    keys = sm.Keyframes(t[::10], np.tile(np.eye(2), (3, 1, 1)), points)
    bound = sm.JetConstraint(lambda jet: jet.x[0], lower=-np.inf, upper=1e-4, name="x")
    everywhere = sm.curve_program(keys, constraints=[bound], degree=3).constraint("x").everywhere
    assert everywhere is not None
    peaks, heights = everywhere.peaks(sm.splines.Spline(basis, controls), {})
    above = peaks[heights > 0, 0]
    np.testing.assert_allclose(above, [0.98, 1.02], atol=1e-5)
    # 3 · 0.02² − 100 · 0.02³ = 4e-4, relative to the limit.
    np.testing.assert_allclose(heights[heights > 0], 3.0, rtol=1e-8)

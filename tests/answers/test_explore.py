from concurrent.futures import ThreadPoolExecutor
from math import comb
from typing import Any, cast

import numpy as np
import pytest

import symmotion as sm
from studies.solving.hard_keyframes import problem
from symmotion.answers.explore import expected_share, expected_unseen
from symmotion.answers.starts import HOP, RANDOM, Start, begun, spread


def turned(*degrees: float) -> sm.Keyframes:
    linear = np.stack([sm.examples.rotation_2d(a) for a in degrees])
    return sm.Keyframes(np.arange(len(degrees), dtype=float), linear, np.zeros((len(degrees), 2)))


def test_half_a_turn_has_two_lowest_minima_that_mirror_each_other():
    found = sm.explore(sm.affine_program(turned(0, 180), refine=0), budget=24)
    one, other = found.minima[:2]
    assert one.objective == pytest.approx(other.objective, rel=1e-10)
    mirror = np.diag([1.0, -1.0])
    t = np.linspace(0, 1, 5)
    np.testing.assert_allclose(mirror @ one.motion(t).linear @ mirror, other.motion(t).linear, atol=1e-7)
    for k, solution in enumerate(found.minima):
        assert solution.certificate.holds(1e-8) and found.counts[k] == found.led.count(k) > 0
    objectives = [s.objective for s in found.minima]
    assert objectives == sorted(objectives) and found.best is one


def test_a_lower_minimum_is_found_than_that_of_the_own_start():
    """5.7958 from the program's own start, 4.0052 is known."""
    program = problem(90).program
    own = sm.ExactNewton().solve(program).require()
    found = sm.explore(program, budget=26)
    assert found.best.objective < 0.7 * own.objective
    assert any(s.objective == own.objective for s in found.minima)


def test_the_answer_is_the_same_whatever_the_workers():
    program = sm.affine_program(turned(0, 150, 320), refine=0)
    here = sm.explore(program, budget=18, seed=4, unseen=0)
    with ThreadPoolExecutor(2) as threads:
        for workers in (threads, 1):
            there = sm.explore(program, budget=18, seed=4, unseen=0, executor=workers)
            assert (there.counts, there.led, there.starts) == (here.counts, here.led, here.starts)
            for one, other in zip(here.minima, there.minima, strict=True):
                np.testing.assert_array_equal(one.x, other.x)
    assert [s.kind for s in here.starts[:4]] == ["own", "rigid", "winding", "random"]
    assert [s.kind for s in here.starts[4:8]] == [HOP] * 4
    assert {"staged"} <= {s.kind for s in here.starts}
    assert {RANDOM, HOP} <= {s.kind for s in here.starts} and len(here.starts) == 18


def test_what_is_not_seen_is_the_posterior_mean_of_equally_likely_shares():
    """P(w | n, k) = C(k, w) C(n − 1, w − 1)/C(n + k − 1, n) where all shares of k minima are equally likely."""
    for n, w in ((14, 2), (16, 3), (12, 1)):
        k = range(w, 4000)
        weights = np.array([float(comb(j, w) * comb(n - 1, w - 1)) / float(comb(n + j - 1, n)) for j in k])
        weights /= weights.sum()
        unseen = np.array(k) - w
        assert expected_unseen(n, w) == pytest.approx(weights @ unseen, rel=1e-6)
        assert expected_share(n, w) == pytest.approx(weights @ (unseen / (n + np.array(k))), rel=1e-6)
    assert expected_unseen(4, 2) == np.inf and expected_share(1, 1) == 1.0


def test_it_stops_where_nothing_more_is_expected():
    """E is convex: one minimum."""
    convex = sm.affine_program(turned(0, 120, 240), objective=sm.TrajectoryEnergy(np.eye(2)))
    found = sm.explore(convex, budget=100)
    assert len(found.minima) == 1 and len(found.starts) < 50
    assert found.draws >= 8 and found.unseen < 0.5 and "expected to be unseen" in found.reason
    text = str(found)
    assert "1 minimum" in text and "random starts" in text and "lowest" in repr(found)


def tight(keys: sm.Keyframes) -> sm.program.Program:
    floor = sm.JetConstraint(lambda jet: jet.A[0, 0], lower=-1.02, upper=1.02, at=[0.5, 1.5], name="floor")
    return sm.affine_program(keys, constraints=[floor])


def programs() -> dict[str, sm.program.Program]:
    keys = sm.examples.random_keyframes(3, 80, seed=1)
    samples = sm.examples.random_keyframes(12, 30, seed=2)
    return {
        "orientation": sm.orientation_program(keys),
        "pose": sm.pose_program(keys),
        "fit": sm.fit_program(samples, controls=5, objective=0.1 * sm.Rigidity()),
        "inequalities": tight(turned(0, 100, 200)),
    }


@pytest.mark.parametrize("kind", ["orientation", "pose", "fit", "inequalities"])
def test_programs_of_every_kind(kind):
    program = programs()[kind]
    found = sm.explore(program, budget=8, unseen=0)
    assert len(found.starts) == 8 and sum(found.counts) >= 6
    assert found.best.objective <= sm.ExactNewton().solve(program).require().objective * (1 + 1e-9)
    assert all(s.certificate.holds(1e-8) for s in found.minima)


def test_random_starts_spread_in_the_units_of_what_they_change():
    keys = sm.Keyframes([0.0, 1.0, 2.0], turned(0, 60, 120).linear, 1e3 * np.array([[0.0, 0], [1, 2], [3, 1]]))
    program = sm.affine_program(keys, objective=sm.Rigidity() + sm.TrajectoryEnergy(np.eye(2)))
    sizes = program.unpack(spread(program))["controls"]
    assert 100 < sizes[0, 4] < 3000 and 0.1 < sizes[0, 0] < 2
    one, other = (begun(program, Start(RANDOM, k, 3), sm.ExactNewton()) for k in (0, 0))
    np.testing.assert_array_equal(cast(Any, one), cast(Any, other))


def test_what_is_refused():
    program = sm.affine_program(turned(0, 90), refine=0)
    with pytest.raises(sm.InputError, match="budget"):
        sm.explore(program, budget=0)
    with pytest.raises(sm.InputError, match="unseen"):
        sm.explore(program, budget=3, unseen=-1.0)
    with pytest.raises(sm.InputError, match="program"):
        sm.explore(cast(Any, "program"), budget=3)
    with pytest.raises(sm.InputError, match="no method solve"):
        sm.explore(program, budget=3, solver=cast(Any, 3))
    failing = sm.explore(program, budget=2, solver=sm.ExactNewton(max_iterations=1))
    with pytest.raises(sm.InputError, match="no start"):
        _ = failing.best

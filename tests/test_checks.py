import numpy as np
import pytest

from symmotion import InputError, checks


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: checks.whole(2.5, 1, "degree"), r"degree 2.5: a whole number, 1 or more"),
        (lambda: checks.whole(True, 0, "refine"), r"refine True: a whole number"),
        (lambda: checks.whole("3", 0, "refine"), r"refine '3': a whole number"),
        (lambda: checks.whole(float("nan"), 0, "refine"), r"refine nan: a whole number"),
        (lambda: checks.whole(10**400, 0, "refine"), r"refine 10+….*, at most 2147483647, is needed"),
        (lambda: checks.positive(10**400, "limit"), r"limit 10+….*"),
        (lambda: checks.number(-(10**400), "limit"), r"limit -10+….*"),
        (lambda: checks.positive(0, "limit"), r"limit 0: a positive number"),
        (lambda: checks.positive("1", "limit"), r"limit '1': a positive number"),
        (lambda: checks.not_negative(-1, "weight"), r"weight -1: a finite number, 0 or more"),
        (
            lambda: checks.choice("open", ("natural", "clamped"), "ends"),
            r"ends 'open' is unknown; there are natural, cl",
        ),
        (lambda: checks.array(np.zeros((2, 2)), ("M", 3), "points"), r"points of shape \(2, 2\): finite, \(M, 3\), is"),
        (lambda: checks.array(np.zeros((2, 3)), ("M", "M"), "weights"), r"weights of shape \(2, 3\): finite, \(M, M\)"),
        (lambda: checks.array([np.inf], (1,), "v"), r"v of shape \(1,\): finite, \(1,\), is needed"),
        (lambda: checks.array("a", (1,), "v"), r"v: a str is no array of numbers"),
        (lambda: checks.numbers(np.ma.array([1.0, 2.0], mask=[False, True]), "v"), r"v: entries are masked"),
        (lambda: checks.numbers([1j], "v"), r"v: complex numbers"),
        (lambda: checks.numbers(["1.5"], "v"), r"v: a list is no array of numbers"),
        (lambda: checks.numbers(np.array(["1.5"], dtype=object), "v"), r"v: a ndarray is no array of numbers"),
        (lambda: checks.numbers(True, "v"), r"v: a bool is no array of numbers"),
        (lambda: checks.numbers(None, "v"), r"v: a NoneType is no array of numbers"),
        (lambda: checks.numbers(np.datetime64("2020-01-01"), "v"), r"v: dates or durations; numbers"),
        (lambda: checks.choice(np.zeros(2), ("a",), "ends"), r"ends array\(\[0., 0.\]\) is unknown"),
        (lambda: checks.index(4, 4, "keyframe"), r"keyframe 4 does not exist: there are 4"),
        (lambda: checks.index(1.0, 4, "keyframe"), r"keyframe 1.0 does not exist"),
        (lambda: checks.indices(1, 4, "keyframes"), r"keyframes 1: a list of whole numbers is needed"),
        (lambda: checks.indices("12", 4, "keyframes"), r"keyframes '12': a list of whole"),
        (lambda: checks.times([0.0, 2.0, 1.0]), r"times: number 2 \(1\) does not come after number 1 \(2\)"),
        (lambda: checks.times([0.0, np.nan]), r"times: number 1 is not finite"),
        (lambda: checks.times([[0.0]]), r"times of shape \(1, 1\): \(M,\), M ≥ 1"),
    ],
)
def test_names_what_is_wrong(call, message):
    with pytest.raises(InputError, match=message):
        call()


def test_hands_on_copies():
    given = np.arange(6.0).reshape(2, 3)
    taken = checks.array(given, ("M", 3), "points")
    taken[0, 0] = 7.0
    assert given[0, 0] == 0.0
    assert checks.whole(np.int64(3), 1, "degree") == 3
    assert checks.index(-1, 4, "keyframe") == 3 and checks.indices(np.array([2, -4, 2]), 4, "keyframes") == [0, 2]
    assert checks.times([1, 2]).tolist() == [1.0, 2.0]

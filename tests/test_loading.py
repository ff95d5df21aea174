"""What is read back, and how a damaged file is refused."""

import json
import os

import numpy as np
import pytest
from movements import CURVES, MOTIONS, NET

import symmotion as sm
from symmotion.curves import SymbolicSpline
from symmotion.loading import CLASSES, load
from symmotion.motions.interpolants.slerps import SegmentCurve


def test_files_of_write_motion_and_write_two_parameter_are_loaded(tmp_path):
    for name in ("affine", "affine, periodic"):
        sm.write_motion(MOTIONS[name], tmp_path / "m.json")
        assert load(tmp_path / "m.json") == MOTIONS[name]
    for net in (NET, sm.motions.TwoParameterMotion(NET.u, NET.v, NET.real)):
        sm.files.write_two_parameter(net, tmp_path / "n.json")
        assert load(tmp_path / "n.json") == net


def test_a_symbolic_spline_is_saved_when_its_symbols_have_values(tmp_path):
    spline = CURVES["spline"]
    SymbolicSpline(spline.basis.knots, spline.control_points, 3).save(tmp_path / "s.json")
    assert load(tmp_path / "s.json") == spline
    ca = pytest.importorskip("casadi")
    with pytest.raises(sm.InputError, match="the symbols c_0 have no values yet"):
        SymbolicSpline([0, 0, 1, 1], ca.vertcat(ca.SX.sym("c_0"), 1), 1).save(tmp_path / "s.json")


def test_what_is_no_data_or_not_finite_is_not_saved(tmp_path):
    own = SegmentCurve(np.array([0.0, 1.0]), lambda i, u: np.tile([1.0, 0, 0, 0], (len(u), 1)))
    with pytest.raises(sm.InputError, match=r"m.json: SegmentCurve.segment is a function: code and data of your own"):
        own.save(tmp_path / "m.json")
    open_ = sm.AffineMotion(sm.splines.BSplineBasis.clamped([0, 1], 1), np.full((2, 2, 2), np.nan))
    with pytest.raises(sm.InputError, match=r"AffineMotion\.linear has an entry that is not finite"):
        open_.save(tmp_path / "m.json")
    with pytest.raises(sm.InputError, match="there is no directory"):
        MOTIONS["affine"].save(tmp_path / "none" / "m.json")
    assert not list(tmp_path.iterdir())


def entries(motion, tmp_path):
    motion.save(tmp_path / "m.json")
    return json.loads((tmp_path / "m.json").read_text())


def changed(document, place, value):
    """The document with an entry replaced, or dropped where the value is ...; place: its names, dotted."""
    *way, last = place.split(".")
    part = document
    for name in way:
        part = part[name]
    if value is ...:
        del part[last]
    else:
        part[last] = value
    return document


@pytest.mark.parametrize(
    ("motion", "place", "value", "message"),
    [
        ("affine", "linear", ..., "m.json: linear is missing: AffineMotion has basis, linear, translation"),
        ("affine", "extra", 1, "m.json: extra is unknown"),
        ("affine", "class", "Motion", "m.json: class 'Motion' is unknown; there are BSplineBasis, Spline"),
        ("affine", "class", ["Spline"], "class .* is unknown"),
        ("affine", "class", "Spline", "control_points is missing: Spline has"),
        ("affine", "basis", 3.0, "m.json: basis: BSplineBasis, is needed"),
        ("affine", "basis.class", "Steady", "m.json: basis.times is missing"),
        ("affine", "basis.degree", 2.5, "m.json: basis.degree: a whole number, is needed"),
        ("affine", "basis.degree", True, "m.json: basis.degree: a whole number, is needed"),
        ("affine", "basis.degree", -1, "m.json: basis: degree -1: a whole number, 0 or more, is needed"),
        ("affine", "basis.degree", 4, "m.json: control matrices of shape"),
        ("affine", "basis.knots", [0, "a"], "m.json: basis.knots: numbers are needed"),
        ("affine", "basis.periodic", "no", "m.json: basis.periodic: true or false, is needed"),
        ("affine", "linear", [[1, 2], [3]], "m.json: linear: numbers are needed, in lists of equal lengths"),
        ("affine", "linear", [float("inf")], "m.json: linear: a number is not finite"),
        ("affine", "linear", None, "m.json: linear: numbers, is needed"),
        ("affine", "symmotion", "values", "symmotion 'values', version 1: this is no file of a motion or curve"),
        ("affine", "version", 2, "version 2: this is no file"),
        ("affine", "version", ..., "version None: this is no file"),
        ("logarithm", "series.generator.basis.knots", [], "m.json: series.generator.basis: 0 knots are too few"),
        ("logarithm", "highest", 1.5, "m.json: highest: a whole number or null, is needed"),
        (
            "logarithm",
            "series",
            {"class": "Slerps", "quaternions": [[1, 0, 0, 0]]},
            "series: Exponential or Steady",
        ),
        ("quaternion", "control_points", [[2, 0, 0, 0]] * 6, "m.json: control quaternion 0 has length 2"),
    ],
)
def test_a_damaged_file_is_refused_by_the_entry(tmp_path, motion, place, value, message):
    document = changed(entries(MOTIONS[motion], tmp_path), place, value)
    (tmp_path / "m.json").write_text(json.dumps(document))
    with pytest.raises(sm.InputError, match=message):
        load(tmp_path / "m.json")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "m.json: is empty"),
        ('{"symmotion": "value",', "m.json, line 1"),
        ("[1, 2]", r"m.json: a JSON object, \{…\}, is needed"),
        ("[" * 100_000, "m.json: its lists are nested too deeply"),
        (b"\xff\xfe\x00", "m.json: is not UTF-8 text"),
        ("{}", "symmotion None"),
        ('{"symmotion": "two-parameter-motion", "version": 1}', "m.json, degree: two whole numbers"),
        ('{"symmotion": "affine-motion", "version": 1}', "m.json: linear is missing"),
        (
            '{"symmotion": "value", "version": 1, "class": "BSplineBasis", "knots": [0, 1], "degree": 0, '
            '"periodic": false}',
            "BSplineBasis is a part of motions and curves, and none itself",
        ),
    ],
)
def test_a_file_that_is_none_is_refused(tmp_path, text, message):
    (tmp_path / "m.json").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(sm.InputError, match=message):
        load(tmp_path / "m.json")


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(sm.InputError, match=r"none.json: cannot be read: No such file"):
        load(tmp_path / "none.json")


def test_the_table_names_the_fields_of_every_class():
    from dataclasses import fields

    for cls, kinds in CLASSES.items():
        assert [f.name for f in fields(cls)] == list(kinds)


def test_a_device_is_not_read_for_ever():
    with pytest.raises(sm.InputError, match="is a directory or a device"):
        sm.load("/dev/zero" if os.path.exists("/dev/zero") else ".")

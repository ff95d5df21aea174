"""One body of every form: the same polygons in pictures, films, players, stills and written scenes."""

import pickle

import matplotlib
import numpy as np
import pytest
import trimesh
from PIL import Image

import symmotion as sm
from symmotion.bodies import Body, Mesh, eight_ellipses, grid_mesh, joined, jug, letter_k, wedge
from symmotion.report import player
from symmotion.views import draw_bodies, draw_body, draw_outlines, new_figure, view_from

matplotlib.use("Agg")
import matplotlib.pyplot as plt

BOX = trimesh.creation.box(extents=(1.0, 0.6, 0.4))
CORNERS, FACES = np.array(BOX.vertices), np.array(BOX.faces)
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]])
FLAT = {
    "none": None,
    "outline": SQUARE,
    "list of lists": SQUARE.tolist(),
    "outlines": [SQUARE, SQUARE[:3] + 2],
    "outlines alike": np.stack([SQUARE, SQUARE + 2]),
    "mesh": (SQUARE, np.array([[0, 1, 2, 3]])),
    "faces of several lengths": (SQUARE, [[0, 1, 2], [0, 1, 2, 3]]),
    "letter K": letter_k(),
    "eight ellipses": eight_ellipses(),
    "body": Body(SQUARE, ((0, 1, 2, 3),)),
}
SOLID = {
    "none": None,
    "outline": CORNERS[FACES[0]],
    "outlines": [CORNERS[face] for face in FACES],
    "wedge": wedge(),
    "mesh": (CORNERS, FACES),
    "trimesh": BOX,
    "closed mesh": Mesh(CORNERS, FACES),
    "quadrilaterals": jug().scaled(1.0),
    "body": Body(CORNERS, tuple(map(tuple, FACES.tolist()))),
}
SHAPES = [pytest.param(2, s, id=f"plane, {n}") for n, s in FLAT.items()]
SHAPES += [pytest.param(3, s, id=f"space, {n}") for n, s in SOLID.items()]


def motion_in(dimension) -> sm.AffineMotion:
    keys = sm.examples.planar_keyframes() if dimension == 2 else sm.examples.spatial_keyframes()
    return sm.interpolants.component_cubic(keys)


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


@pytest.mark.parametrize(("dimension", "shape"), SHAPES)
def test_every_form_is_one_body(dimension, shape):
    body = Body.of(shape, dimension)
    assert body.dimension == dimension == body.vertices.shape[1]
    assert Body.of(body, dimension) is body
    again = pickle.loads(pickle.dumps(body))
    assert again == body and hash(again) == hash(body)
    assert not body.vertices.flags.writeable and not again.vertices.flags.writeable
    assert [len(p) for p in body.polygons()] == [len(face) for face in body.faces]
    assert f"{dimension}D" in repr(body)
    assert body.triangles.shape == (sum(len(face) - 2 for face in body.faces), 3)
    assert np.ptp(body.scaled(3.0).vertices, axis=0).max() == pytest.approx(3.0)
    assert not body.in_space().vertices[:, dimension:].any()
    assert len(joined([body, body]).faces) == 2 * len(body.faces)


@pytest.mark.parametrize(("dimension", "shape"), SHAPES)
def test_every_form_is_drawn_played_filmed_and_written(dimension, shape, tmp_path):
    motion = motion_in(dimension)
    body = Body.of(shape, dimension)
    axes = motion.plot(body=shape, times=5)
    drawn = [np.asarray(path.vertices)[:-1] for collection in axes.collections for path in collection.get_paths()]
    assert len(drawn) == 5 * len(body.faces)
    if dimension == 2 and shape is not None:
        places = body.polygons(motion(np.linspace(*motion.domain, 5))(body.vertices))
        for p, q in zip(drawn, places, strict=True):
            np.testing.assert_allclose(p, q, atol=1e-12)
    made = player("a", {"m": motion}, shape, "")
    assert made.dimension == dimension and made.body.vertices.max() > 0
    assert 0 < len(made.body.faces) <= len(body.faces)
    sm.views.write_animation(motion, tmp_path / "m.gif", shape, seconds=0.2, fps=10)
    with Image.open(tmp_path / "m.gif") as film:
        assert (np.ptp(np.asarray(film.convert("RGB")).astype(float), axis=2) > 60).any()
    for write, name in ((sm.files.write_gltf, "m.glb"), (sm.files.write_usd, "m.usda")):
        assert write(motion, tmp_path / name, shape).error >= 0
    (mesh,) = trimesh.load_scene(tmp_path / "m.glb", process=False).geometry.values()
    assert len(mesh.faces) == len(body.triangles)


@pytest.mark.parametrize(("dimension", "shape"), SHAPES)
def test_every_form_is_drawn_on_axes_that_the_caller_brings(dimension, shape):
    with new_figure() as figure:
        axes = figure.add_subplot()
        body = Body.of(shape, dimension)
        if dimension == 2:
            draw_body(axes, motion_in(2), shape, np.array([0.0, 1.0]))
            assert [len(c.get_paths()) for c in axes.collections] == [len(body.faces)] * 2
        else:
            draw_bodies(axes, np.stack([np.eye(3)] * 2), np.eye(3)[:2], shape)
            draw_outlines(axes, lambda points: points, shape, view=view_from([1.0, -1.0, 1.0]))
            assert [len(c.get_paths()) for c in axes.collections] == [2 * len(body.faces), len(body.faces)]


def test_the_default_letter_is_closed_shows_its_sides_and_stands_up():
    letter = Body.of(None, 3, size=2.0)
    assert np.ptp(letter.vertices, axis=0) == pytest.approx([1.4, 0.4, 2.0])
    solid = trimesh.Trimesh(letter.vertices, letter.triangles)
    bars = (0.25 * 1 + 0.45 * 0.25 + 0.3 * 0.2) * 0.2 * 2.0**3
    assert solid.is_watertight and solid.volume == pytest.approx(bars)
    assert len({tuple(c) for c in letter.shown_colours.tolist()}) == 3
    standing = Body.of(None, 3, size=2.0, up="y")
    assert np.ptp(standing.vertices, axis=0) == pytest.approx([1.4, 2.0, 0.4])
    assert trimesh.Trimesh(standing.vertices, standing.triangles).volume == pytest.approx(bars)
    flat = Body.of(None, size=2.0)
    assert flat.dimension == 2 and np.ptp(flat.vertices, axis=0) == pytest.approx([1.4, 2.0])


def area(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


STAR = np.array([[np.cos(a), np.sin(a)] for a in np.arange(14) * np.pi / 7]) * np.tile([1.0, 0.3], 7)[:, None]
COMB = np.array([(0, 0), (7, 0), (7, 3), (6, 1), (5, 3), (4, 1), (3, 3), (2, 1), (1, 3), (0, 1)], dtype=float)
DART = np.array([[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]])
POLYGONS = {"K": letter_k()[0], "star": STAR, "comb": COMB, "dart": DART, "closed": np.concatenate([COMB, COMB[:1]])}


@pytest.mark.parametrize("turn", [0, 1, 3])
@pytest.mark.parametrize("way", [1, -1], ids=["anticlockwise", "clockwise"])
@pytest.mark.parametrize("polygon", POLYGONS.values(), ids=POLYGONS)
def test_triangles_cover_a_polygon_once(polygon, way, turn):
    points = np.roll(polygon, turn, axis=0)[::way]
    closed = np.concatenate([points, points[:1]])
    whole = np.sum(closed[:-1, 0] * closed[1:, 1] - closed[:-1, 1] * closed[1:, 0]) / 2
    # Of one sign, and together as large: none overlaps another.
    for body in (Body.of(points), Body.of(np.column_stack([points[:, 0], points]))):
        pieces = area(body.vertices[:, -2:], body.triangles)
        assert (pieces * np.sign(whole) >= -1e-12).all()
        assert pieces.sum() == pytest.approx(whole)


def test_convex_polygons_become_fans():
    assert Body.of(SQUARE).triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert grid_mesh(np.zeros((2, 2, 3))).triangles.tolist() == [[0, 2, 3], [0, 3, 1]]


@pytest.mark.parametrize(
    ("shape", "dimension", "message"),
    [
        ([], 2, "one outline or more"),
        (SQUARE, 3, r"outline 0: shape \(4, 2\); \(P, 3\), P ≥ 2"),
        ([SQUARE, SQUARE[0]], None, r"outline 1: shape \(2,\)"),
        (np.zeros((4, 5)), None, r"outline 0: shape \(4, 5\); \(P, 2\)"),
        ([[0.0, np.inf], [1.0, 1.0]], 2, "outline 0: a point is not finite"),
        (BOX, 2, "a body in dimension 3: dimension 2 is needed"),
        ((SQUARE, SQUARE), 2, "body faces of shape .4, 2.: whole numbers .* outlines are given in a list"),
        ((CORNERS, FACES.astype(float)), 3, r"body faces of shape \(12, 3\): whole numbers \(F, k\)"),
        ((CORNERS, FACES + 1), 3, "has a corner that is none of its vertices, 0 … 7"),
        ((CORNERS, [[0, 1, 2], [0, 1, 2, 9]]), 3, "face 1 of the body has a corner that is none"),
        ((CORNERS, [[0, 1, 2], [0]]), 3, "body, face 1: two corners or more"),
        ((CORNERS[:, :1], FACES), None, r"body vertices of shape \(8, 1\)"),
        ("box.obj", 3, "a file is read first, by trimesh.load"),
        (object(), 3, "a object is no outline; closed polygons"),
    ],
)
def test_what_is_no_body_is_refused(shape, dimension, message):
    with pytest.raises(sm.InputError, match=message):
        Body.of(shape, dimension)


def test_bad_fields_name_the_culprit():
    with pytest.raises(sm.InputError, match="one face or more"):
        Body(SQUARE, ())
    with pytest.raises(sm.InputError, match=r"body colours of shape \(1, 3\)"):
        Body(SQUARE, ((0, 1, 2),), np.zeros((1, 3)))
    with pytest.raises(sm.InputError, match="a body of lines alone has no triangles"):
        _ = Body.of(SQUARE[:2]).triangles


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sm.bodies.joined([]), "0 bodies: one or more, of one dimension, are needed"),
        (
            lambda: sm.bodies.joined([sm.bodies.jug(), Body.of([[0, 0], [1, 0], [0, 1]], 2)]),
            "2 bodies: one or more, of one",
        ),
        (lambda: sm.bodies.ellipsoid_mesh([1.0, 2.0]), r"semi-axes of shape \(2,\): finite, \(3,\), is needed"),
        (lambda: sm.bodies.jug(2), "segments 2: a whole number of faces round the axis, 3 or more"),
    ],
)
def test_what_makes_no_body(call, message):
    with pytest.raises(sm.InputError, match=message):
        call()

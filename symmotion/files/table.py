"""The table of formats: everything that reads or writes a file finds its way here."""

from collections.abc import Callable
from dataclasses import replace

from symmotion import checks
from symmotion.bodies.shapes import UPRIGHT
from symmotion.errors import InputError
from symmotion.files.bvh import checked_encoding, read_bvh_keyframes, read_bvh_skeleton
from symmotion.files.bvh_writing import write_bvh, write_bvh_keyframes
from symmotion.files.cameras import is_colmap, is_transforms, read_colmap, read_log, read_transforms
from symmotion.files.columns import checked_columns
from symmotion.files.formats import Format, Option
from symmotion.files.gltf_keyframes import read_gltf
from symmotion.files.gltf_skeletons import read_gltf_skeleton
from symmotion.files.gltf_writing import write_gltf
from symmotion.files.keyframe_json import is_keyframes_json, read_keyframes_json, write_keyframes_json
from symmotion.files.meshes import checked_body, write_obj, write_ply, write_stl
from symmotion.files.motion_json import is_motion_json, read_motion_json, write_motion_json
from symmotion.files.optitrack import is_optitrack, read_optitrack
from symmotion.files.plates import read_rot
from symmotion.files.samples import write_samples_csv, write_samples_tum
from symmotion.files.text import read_csv, read_kitti, read_tum, read_txt, write_csv, write_kitti, write_tum
from symmotion.files.two_parameter import is_net_json, read_net_json, read_net_npz, write_net_json, write_net_npz
from symmotion.files.usd import ENDINGS, check_usd, write_usd
from symmotion.files.usd_reading import read_usd, read_usd_skeleton
from symmotion.files.written import TOLERANCE
from symmotion.pictures import FILM_SECONDS, FRAMES_PER_SECOND, check_film, write_film


def name_or_index(text: str) -> str | int:
    """A word as an index where it is a number, else as a name."""
    return int(text) if text.isdecimal() else text


def one_character(value: str, what: str) -> str:
    """The value; InputError unless it is one character."""
    if not isinstance(value, str) or len(value) != 1:
        raise InputError(f"{what} {value!r}: one character is needed")
    return value


def character(text: str) -> str:
    """A word as a character: a tab as `\\t`, which shells do not read."""
    return "\t" if text == "\\t" else text


def one_of(*known: str) -> Callable[[object, str], object]:
    """A check that a value is one of these words."""
    return lambda value, what: checks.choice(value, known, what)


TIMES = Option("times", "times (M,) in place of the file's")
DELIMITER = Option("delimiter", "the character between columns", character, check=one_character)
COLUMNS = Option(
    "columns", "roles of columns: time=stamp;translation=a,b,c;quaternion=x,y,z,w", str, check=checked_columns
)
ANGLES = Option("angles", "unit of angles that name none: rad or deg", str, check=one_of("rad", "deg"))
LOST = Option("lost", "rows of lost tracking: error or drop", str, check=one_of("error", "drop"))
REPEATED = Option(
    "repeated", "times that repeat or crowd: error, drop or merge", str, check=one_of("error", "drop", "merge")
)
NORMS = Option("norms", "how far norms of quaternions may be from 1; default: 0.001", float, check=checks.positive)
TEXT = (TIMES, DELIMITER, COLUMNS, ANGLES, LOST, REPEATED, NORMS)
NODE = Option("node", "joint or node, by name or index; default: the root", name_or_index)
ANIMATION = Option("animation", "animation, by name or index; default: the first that moves the node", name_or_index)
STEPS = Option("steps", "STEP keys: hold or keys alone", str, check=one_of("hold", "keys"))
OFFSETS = Option(
    "offsets",
    "position channels replace a joint's offset or add to it: replace or add",
    str,
    check=one_of("replace", "add"),
)
FRAMES = Option(
    "frames", "where the file claims another number: found or claimed", str, check=one_of("found", "claimed")
)
ENCODING = Option("encoding", "of the names, as shift_jis; default: utf-8", str, check=checked_encoding)

SAMPLE_TIMES = Option("times", "times (N,) of the samples")
RATE = Option("rate", "samples per unit of time; default: 200 in all", float, check=checks.positive)
ORTHONORMALISE = Option("orthonormalise", "write the closest rotation of each sample", bool, False)

BODY = Option("body", "what moves, a mesh as .obj; default: a letter F", str, check=checked_body)
DURATION = Option("seconds", "length; default: a unit of time is a second", float, check=checks.positive)
ACCURACY = Option("tolerance", "of sampled keys, relative to the motion's size", float, TOLERANCE, checks.positive)
SCENE = (BODY, DURATION, ACCURACY)
FILM = (
    BODY,
    Option("seconds", "length of the film", float, FILM_SECONDS, checks.positive),
    Option("fps", "frames per second", float, FRAMES_PER_SECOND, checks.positive),
    Option("up", "the axis that is upright, y or z; default: as FILE says, else z", str, check=one_of(*UPRIGHT)),
)

# All formats, by what they hold; a table of your own may begin with them.
FORMATS = tuple(replace(row, whole=True) for row in (
    Format("tum", ("tum",), "keyframes", "lines t tx ty tz qx qy qz qw", read_tum, write_tum, TEXT),
    Format("kitti", ("kitti",), "keyframes", "lines of 12 numbers, the matrix [A v] row by row", read_kitti,
           write_kitti, TEXT),
    Format("csv", ("csv",), "keyframes", "columns by name: t; x y z; qx qy qz qw, theta or a11 a12 …", read_csv,
           write_csv, TEXT),
    Format("json", ("json",), "keyframes", "an object of arrays: linear, times, translation", read_keyframes_json,
           write_keyframes_json, (TIMES,), claims=is_keyframes_json),
    Format("txt", ("txt",), "keyframes", "tum or kitti, by the number of columns", read_txt,
           reading=TEXT),
    Format("optitrack", ("csv",), "keyframes", "a rigid body of a CSV file of Motive", read_optitrack,
           reading=(TIMES, NODE, LOST, REPEATED, NORMS), claims=is_optitrack),
    Format("colmap", ("txt",), "keyframes", "cameras of images.txt, by name", read_colmap, reading=(TIMES,),
           claims=is_colmap),
    Format("transforms", ("json",), "keyframes", "cameras of a nerfstudio transforms.json", read_transforms,
           reading=(TIMES,), claims=is_transforms),
    Format("log", ("log",), "keyframes", "cameras of an Open3D trajectory", read_log, reading=(TIMES,)),
    Format("bvh", ("bvh",), "keyframes", "a joint of a skeleton, frame by frame", read_bvh_keyframes,
           write_bvh_keyframes, (TIMES, NODE, OFFSETS, FRAMES, ENCODING)),
    Format("gltf", ("glb", "gltf"), "keyframes", "an animated node in the scene, at its keys", read_gltf,
           reading=(TIMES, NODE, ANIMATION, STEPS)),
    Format("usd", ENDINGS, "keyframes", "a prim in the scene, at its time samples", read_usd,
           reading=(TIMES, NODE)),
    Format("rot", ("rot",), "keyframes", "a tectonic plate, by finite rotations", read_rot,
           reading=(TIMES, NODE, REPEATED)),
    Format("json", ("json",), "motion", "a motion of any kind, exactly", read_motion_json, write_motion_json,
           claims=is_motion_json),
    Format("csv", ("csv",), "motion", "samples of linear part and translation", write=write_samples_csv,
           writing=(SAMPLE_TIMES, RATE)),
    Format("tum", ("tum",), "motion", "samples, rigid", write=write_samples_tum,
           writing=(SAMPLE_TIMES, RATE, ORTHONORMALISE)),
    Format("bvh", ("bvh",), "motion", "a rigid body, sampled at equal steps", write=write_bvh,
           writing=(RATE, ORTHONORMALISE)),
    Format("glb", ("glb",), "scene", "an animated glTF scene", write=write_gltf, writing=SCENE),
    Format("usd", ENDINGS, "scene", "an animated USD scene", write=write_usd, writing=SCENE, check=check_usd),
    Format("gif", ("gif",), "film", "played again and again", write=write_film, writing=FILM, check=check_film),
    Format("mp4", ("mp4",), "film", "takes the program ffmpeg", write=write_film, writing=FILM, check=check_film),
    Format("bvh", ("bvh",), "skeleton", "all joints, frame by frame", read_bvh_skeleton,
           reading=(OFFSETS, FRAMES, ENCODING)),
    Format("gltf", ("glb", "gltf"), "skeleton", "all nodes that move and those below", read_gltf_skeleton,
           reading=(ANIMATION, STEPS)),
    Format("usd", ENDINGS, "skeleton", "all prims that move and those below", read_usd_skeleton),
    Format("obj", ("obj",), "mesh", "triangles as text, exactly", write=write_obj),
    Format("ply", ("ply",), "mesh", "triangles, binary, exactly", write=write_ply),
    Format("stl", ("stl",), "mesh", "triangles, binary, in single precision", write=write_stl),
    Format("json", ("json",), "net", "a two-parameter motion, exactly; read also axis, angle [rad], translation, "
           "knots_u, knots_v", read_net_json, write_net_json, claims=is_net_json),
    Format("npz", ("npz",), "net", "the same as arrays of NumPy", read_net_npz, write_net_npz),
))  # fmt: skip

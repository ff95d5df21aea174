"""Keyframes, motions and meshes in and out of files.

Every format is a row of the table `FORMATS`: its ending, what it holds, the functions that read and
write it, their options. One of your own is one more row, handed to a door:

    mine = Format("points", ("pts",), "keyframes", "one position a line", read=read_points)
    keys = read_keyframes("walk.pts", formats=(*FORMATS, mine))
"""

from typing import TYPE_CHECKING

from symmotion.files.bvh import read_bvh
from symmotion.files.bvh_writing import write_bvh
from symmotion.files.formats import Format, Option
from symmotion.files.gltf_keyframes import read_gltf_keyframes
from symmotion.files.gltf_writing import write_gltf
from symmotion.files.grids import ToolPath, read_orientation_grid, read_tool_path, write_tool_path
from symmotion.files.posed import AffineFit, PosedSkeleton
from symmotion.files.reading import read_keyframes, read_motion, read_recording, read_skeleton, read_two_parameter
from symmotion.files.recording import Recording
from symmotion.files.skeleton import Skeleton, joint_trajectories
from symmotion.files.table import FORMATS
from symmotion.files.usd import write_usd
from symmotion.files.usd_reading import read_usd_keyframes
from symmotion.files.writing import write_keyframes, write_mesh, write_motion, write_two_parameter
from symmotion.files.written import WrittenMotion
from symmotion.renamed import moved

__all__ = [
    "FORMATS",
    "AffineFit",
    "Format",
    "Option",
    "PosedSkeleton",
    "Recording",
    "Skeleton",
    "ToolPath",
    "WrittenMotion",
    "joint_trajectories",
    "read_bvh",
    "read_gltf_keyframes",
    "read_keyframes",
    "read_motion",
    "read_orientation_grid",
    "read_recording",
    "read_skeleton",
    "read_tool_path",
    "read_two_parameter",
    "read_usd_keyframes",
    "write_bvh",
    "write_gltf",
    "write_keyframes",
    "write_mesh",
    "write_motion",
    "write_tool_path",
    "write_two_parameter",
    "write_usd",
]

if not TYPE_CHECKING:
    # A name of 0.1.0.
    __getattr__ = moved(__name__, {}, {"whole_file": "symmotion.whole.whole_file"})

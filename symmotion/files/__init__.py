"""Keyframes and motions in and out of files."""

from symmotion.files.bvh import read_bvh
from symmotion.files.gltf_keyframes import read_gltf_keyframes
from symmotion.files.gltf_writing import write_gltf
from symmotion.files.meshes import write_mesh
from symmotion.files.reading import read_keyframes, read_motion
from symmotion.files.skeleton import Skeleton, joint_trajectories
from symmotion.files.two_parameter import read_two_parameter, write_two_parameter
from symmotion.files.usd import write_usd
from symmotion.files.writing import write_keyframes, write_motion
from symmotion.files.written import WrittenMotion

__all__ = [
    "Skeleton",
    "WrittenMotion",
    "joint_trajectories",
    "read_bvh",
    "read_gltf_keyframes",
    "read_keyframes",
    "read_motion",
    "read_two_parameter",
    "write_gltf",
    "write_keyframes",
    "write_mesh",
    "write_motion",
    "write_two_parameter",
    "write_usd",
]

"""Keyframes and motions in and out of files."""

from symmotion.files.reading import read_keyframes, read_motion
from symmotion.files.two_parameter import read_two_parameter, write_two_parameter
from symmotion.files.whole import whole_file
from symmotion.files.writing import write_keyframes, write_motion

__all__ = [
    "read_keyframes",
    "read_motion",
    "read_two_parameter",
    "whole_file",
    "write_keyframes",
    "write_motion",
    "write_two_parameter",
]

"""Keyframes and motions in and out of files."""

from symmotion.files.reading import read_keyframes, read_motion
from symmotion.files.whole import whole_file
from symmotion.files.writing import write_keyframes, write_motion

__all__ = ["read_keyframes", "read_motion", "whole_file", "write_keyframes", "write_motion"]

"""Keyframes out of USD scenes: a prim, or joint, whose place has time samples."""

from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.posed import PosedSkeleton
from symmotion.files.recording import Recording
from symmotion.files.usd_library import library, read_usd_stage
from symmotion.files.usd_scene import Scene, scene_keyframes, scene_skeleton
from symmotion.files.usd_text import Composed, read_usd_text
from symmotion.motions import Keyframes
from symmotion.opening import readable_bytes

ASCII = b"#usda"


def read_usd_keyframes(path: FilePath, node: str | int | None = None, *, times: ArrayLike | None = None) -> Keyframes:
    """The positions of a prim of a .usda, .usd, .usdc or .usdz file in the scene, at its time samples in seconds.

    All operations that place the prim (xformOps of any kind, inverted too) and those above it, at all time codes
    that any of them has a sample at, over timeCodesPerSecond; between samples values are linear, quaternions slerps.
    The joints of a skeleton (UsdSkel) that an animation moves are prims below it, /Man/Bones/hip/knee, placed by the
    animation's arrays, or by its rest transforms where that does not have them. Axes and the unit of length are the
    scene's own.

    node: name, path (/World/Arm) or index; left out: the only prim that moves, or the one that all others which move
    hang from. times: (M,), in place of the file's.

    ASCII is read without Pixar's library. Binary files, packages, and scenes with references, layers or variants
    take it: the extra `symmotion[usd]`. Raises InputError that names the file and the line or prim at fault.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> written = sm.files.write_usd(motion, "motion.usda", tolerance=1e-2)
    >>> len(sm.files.read_usd_keyframes("motion.usda")) == written.keys
    True
    """
    return read_usd(path, node=node, times=times).keyframes


def read_usd(path: FilePath, *, node: str | int | None = None, times: ArrayLike | None = None) -> Recording:
    """As `read_usd_keyframes`, with notes on which prim is read where several move, and on axes and units."""
    return scene_keyframes(path, read_scene(path), node, times)


def read_usd_skeleton(path: FilePath) -> PosedSkeleton:
    """All prims that move and those below; InputError as `read_usd_keyframes`."""
    return scene_skeleton(path, read_scene(path))


def read_scene(path: FilePath) -> Scene:
    """The scene of a file, by our own reader where that can."""
    with readable_bytes(path) as handle:
        own = handle.read(len(ASCII)) == ASCII
    if not own:
        return read_usd_stage(path)
    try:
        return read_usd_text(path)
    except Composed as composed:
        try:
            library(path)
        except InputError:
            raise composed from None
        return read_usd_stage(path)

"""USD by Pixar's own library, usd-core, where it is installed: binary files, packages and scenes put together."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.usd_ops import Samples
from symmotion.files.usd_scene import Prim, Scene
from symmotion.files.usd_skel import PARTS, joint_prims
from symmotion.motions import Affine
from symmotion.opening import readable_bytes
from symmotion.whole import whole_files


def library(path: FilePath) -> Any:  # Any: usd-core ships no types
    """The package pxr; InputError that says how to get it where it is not installed."""
    try:
        import pxr.Sdf
        import pxr.Usd
        import pxr.UsdGeom
        import pxr.UsdSkel
        import pxr.UsdUtils
    except ImportError:
        raise InputError(
            f"{path}: binary USD takes Pixar's library: python -m pip install 'symmotion[usd]', or use .usda"
        ) from None
    return pxr


def read_usd_stage(path: FilePath) -> Scene:
    """The scene of a file of any kind of USD, with what it refers to."""
    pxr = library(path)
    with readable_bytes(path):  # regular, of bounded size
        pass
    try:
        stage = pxr.Usd.Stage.Open(str(path))
        stage.Reload()  # of what another stage in this process may still hold of an older file
    except RuntimeError as error:  # Pixar's errors, in several lines
        reason = str(error).partition(": '")[2].partition("'")[0] or "no stage can be opened"
        raise InputError(f"{path}: is no USD file that Pixar's library reads ({reason})") from None
    geometry, prims, index = pxr.UsdGeom, [], {}
    for prim in stage.Traverse():
        place = geometry.Xformable(prim)
        if not place:  # what has no place leaves what is below it where it is
            index[prim.GetPath()] = index.get(prim.GetParent().GetPath(), -1)
            continue
        index[prim.GetPath()] = len(prims)
        codes = np.array(place.GetTimeSamples(), dtype=float)
        prims.append(
            Prim(
                str(prim.GetPath()),
                index.get(prim.GetParent().GetPath(), -1),
                codes,
                place.GetResetXformStack(),
                partial(_local, stage, place),
            )
        )
    for prim in stage.Traverse():
        if prim.IsA(pxr.UsdSkel.Skeleton):
            prims += _joints(pxr, path, prim, (index[prim.GetPath()], len(prims)))
    unit = geometry.GetStageMetersPerUnit(stage)
    return Scene(prims, stage.GetTimeCodesPerSecond(), str(geometry.GetStageUpAxis(stage)), unit)


# Any: usd-core ships no types.
def _local(stage: Any, place: Any, codes: np.ndarray) -> Affine:
    """The positions of a prim, whose matrices are of rows; the stage, which lives as long as somebody has it."""
    matrices = np.stack([np.array(place.GetLocalTransformation(code)) for code in codes.tolist()])
    return Affine(np.swapaxes(matrices[:, :3, :3], 1, 2), matrices[:, 3, :3])


# Any: usd-core ships no types.
def _joints(pxr: Any, path: FilePath, prim: Any, place: tuple[int, int]) -> list[Prim]:
    """The joints of a skeleton as prims; none of one that no animation moves."""
    skeleton = pxr.UsdSkel.Skeleton(prim)
    source = pxr.UsdSkel.Animation(pxr.UsdSkel.BindingAPI(prim).GetInheritedAnimationSource())
    if not source:
        return []
    parts = {}
    for part in PARTS:
        attribute = source.GetPrim().GetAttribute(part)
        codes = attribute.GetTimeSamples()
        values = [_flat(attribute.Get(code)) for code in codes] or [_flat(attribute.Get())]
        if len({len(row) for row in values}) > 1:
            raise InputError(f"{path}, prim {source.GetPath()}: the arrays of {part} must be of one size")
        if len(values[0]):
            parts[part] = Samples(np.array(codes, dtype=float), np.array(values))
    names, animated = (list(has.GetJointsAttr().Get() or ()) for has in (skeleton, source))
    rest = np.array(skeleton.GetRestTransformsAttr().Get() or (), dtype=float).reshape(-1, 16)
    return joint_prims(path, str(prim.GetPath()), place, names, rest, animated, parts)


# Any: as above.
def _flat(values: Any) -> np.ndarray:
    """The numbers of an array of vectors or quaternions, whose real part comes first; of one without a value none."""
    rows = [(v.GetReal(), *v.GetImaginary()) if hasattr(v, "GetReal") else tuple(v) for v in values or ()]
    return np.array(rows, dtype=float).ravel()


def write_binary(text: str, path: FilePath) -> None:
    """Write a scene, which is there in ASCII, as .usd, .usdc or .usdz."""
    pxr = library(path)
    layer = pxr.Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(text)
    with whole_files(path) as target:
        if target.suffix.lower() != ".usdz":
            layer.Export(str(target))
            return
        inner = Path(target).with_suffix(".usdc")
        layer.Export(str(inner))
        pxr.UsdUtils.CreateNewUsdzPackage(str(inner), str(target))
        inner.unlink()

"""What readers do with files that nobody wrote: damaged at random, by the thousand."""

import warnings
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np

import symmotion as sm
from studies.shares import share
from symmotion.motions import smooth_net
from symmotion.report import Column, Study, StudyOptions, StudyResult, Table

QUICK, FULL = 600, 100_000
SLOW = 5.0  # seconds of CPU that count as a hang: good files take milliseconds
PIECES = (b"nan", b"-inf", b"1e999", b"9" * 30, b"-1", b"0", b"[", b"]", b"{}", b'"', b",", b"\0", b"\xff\xfe", b"\n")
BVH = """HIERARCHY
ROOT hip
{
OFFSET 0 1 2
CHANNELS 3 Zrotation Xposition Yposition
End Site
{
OFFSET 0 0 1
}
}
MOTION
Frames: 2
Frame Time: 0.1
1 2 3
4 5 6
"""


def read_net(path: Path) -> object:
    return sm.files.read_two_parameter(path)


READERS: dict[str, Callable[[Path], object]] = {
    **dict.fromkeys(("tum", "kitti", "csv", "json", "bvh", "glb", "gltf"), sm.read_keyframes),
    **dict.fromkeys(("npz", "net.json"), read_net),
    "saved.json": sm.load,
}


def run(options: StudyOptions) -> StudyResult:
    count = FULL if options.full else QUICK
    rng, rows, faults = np.random.default_rng(0), [], []
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        directory = Path(folder)
        for kind, whole in good_files(directory).items():
            options.progress(kind)
            found = [
                outcome(kind, damaged(rng, whole), directory / f"file.{kind}") for _ in range(count // len(READERS))
            ]
            refused, wrong = found.count("refused"), [f for f in found if f not in ("refused", "read")]
            faults += [f"{kind}: {fault}" for fault in wrong]
            rows.append((kind, len(found), refused, found.count("read"), len(wrong)))
    columns = (Column("format"), Column("files"), Column("refused"), Column("read"), Column("faults"))
    total = sum(row[1] for row in rows)
    text = (
        f"Of {total} damaged files {sum(row[2] for row in rows)} are refused by name, {len(faults)} are not taken well."
    )
    notes = tuple(dict.fromkeys(faults))[:20]
    answer = (
        f"Of {total} damaged files {sum(row[2] for row in rows)} are refused by name and {sum(row[3] for row in rows)} "
        f"read; {share(len(faults), total)} are taken otherwise, which is a fault."
    )
    return StudyResult((Table("outcomes", columns, tuple(rows)),), conclusion=text, notes=notes, answer=answer)


def outcome(kind: str, content: bytes, path: Path) -> str:
    """refused, read, or what is wrong with how a file is taken."""
    path.write_bytes(content)
    began = process_time()
    try:
        found = READERS[kind](path)
    except sm.InputError as error:
        said = str(error)
        answer = "refused" if said.isprintable() and path.name in said else f"a message as {said[:80]!r}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    else:
        answer = "read" if is_finite(found) else "an answer that is not finite"
    return answer if process_time() - began < SLOW else f"takes {process_time() - began:.1f} s"


def is_finite(found: object) -> bool:
    if isinstance(found, sm.Keyframes):
        return all(np.isfinite(a).all() for a in (found.times, found.linear, found.translation))
    return True  # motions refuse what is not


def damaged(rng: np.random.Generator, whole: bytes) -> bytes:
    """A file with one to four places in it cut out, put in, or other than they were."""
    text = bytearray(whole)
    for _ in range(int(rng.integers(1, 5))):
        place, length = int(rng.integers(len(text) + 1)), int(rng.choice([0, 0, 1, 1, 4, 20, len(text)]))
        piece = PIECES[rng.integers(len(PIECES))] if rng.random() < 0.5 else rng.bytes(int(rng.integers(6)))
        text[place : place + length] = piece
    return bytes(text)


def good_files(directory: Path) -> dict[str, bytes]:
    """A good file of every format that is read."""
    keys = sm.examples.random_keyframes(3, 50, seed=1)
    keys = sm.Keyframes(np.arange(3.0), keys.linear, keys.translation)
    for kind in ("tum", "kitti", "csv", "json"):
        sm.write_keyframes(keys, directory / f"good.{kind}")
    (directory / "good.bvh").write_text(BVH)
    motion = sm.ExactNewton().solve(sm.affine_program(keys)).motion
    motion.save(directory / "good.saved.json")
    sm.files.write_motion(motion, directory / "good.glb")
    binary = (directory / "good.glb").read_bytes()
    (directory / "good.gltf").write_bytes(binary[20 : 20 + int.from_bytes(binary[12:16], "little")])
    net = smooth_net(6)
    for kind in ("npz", "net.json"):
        sm.files.write_two_parameter(net, directory / f"good.{kind}")
    return {kind: (directory / f"good.{kind}").read_bytes() for kind in READERS}


STUDY = Study(
    "fuzzing", "What becomes of damaged files?", "files of every format read, damaged at random", run, order=95
)

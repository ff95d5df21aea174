"""Archives of arrays: sizes known before anything is unpacked, and no exception of others."""

import io
import resource
import struct
import zipfile

import numpy as np
import pytest

import symmotion as sm
from symmotion.files import archives
from symmotion.files.archives import read_arrays
from symmotion.motions.nets import smooth_net

MB = 2**20


def member(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def claiming(shape: str, kind: str = "<f8") -> bytes:
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header


def archive(path, entries: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED, zeros: int = 0):
    """An archive of these members, each followed by zeros."""
    with zipfile.ZipFile(path, "w", method, compresslevel=1) as file:
        for name, data in entries.items():
            with file.open(name, "w") as stream:
                stream.write(data)
                for k in range(0, zeros, MB):
                    stream.write(bytes(min(MB, zeros - k)))
    return path


def test_arrays_come_back_as_numpy_has_them(tmp_path):
    rng = np.random.default_rng(0)
    arrays = {
        "a": rng.normal(size=(3, 4)),
        "b": np.asfortranarray(rng.normal(size=(3, 4, 2))),
        "c": np.arange(5, dtype=">i2"),
        "d": np.array("text"),
        "e": np.zeros((0, 4), dtype="<f4"),
    }
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", **arrays)
        found = read_arrays(tmp_path / "a.npz")
        assert found.keys() == arrays.keys()
        for name, array in arrays.items():
            np.testing.assert_array_equal(found[name], array)


CASES = {
    "claims much": (
        lambda p: archive(p, {"axis.npy": claiming("(1000000000000,)")}),
        "claims 8000000000000 bytes where",
    ),
    "overflows": (
        lambda p: archive(p, {"axis.npy": claiming("(4294967296, 4294967296)")}),
        "claims .* where there are 0",
    ),
    "negative": (lambda p: archive(p, {"axis.npy": claiming("(-1,)")}), "an array of numbers is needed"),
    "objects": (
        lambda p: archive(p, {"axis.npy": claiming("(1,)", "|O") + b"x" * 8}),
        "of numbers is needed, not of obj",
    ),
    "deep": (lambda p: archive(p, {"axis.npy": claiming("(" * 50)}), "its header is not that of an array"),
    "no header": (lambda p: archive(p, {"axis.npy": b"nothing"}), "its header is not that of an array"),
    "bomb": (lambda p: archive(p, {"axis.npy": claiming("(1048576,)")}, zeros=8 * MB), "8 MB unpacked: 4 MB"),
    "small numbers": (lambda p: archive(p, {"axis.npy": claiming("(600000,)", "|u1")}, zeros=600000), "of doubles"),
    "member": (lambda p: archive(p, {"../axis\x1b": b""}), r"member '../axis\\x1b' is no array"),
    "many": (lambda p: archive(p, {f"{k}.npy": b"" for k in range(1001)}, zipfile.ZIP_STORED), "1001 members"),
    "no archive": (lambda p: p.write_bytes(b"PK\x03\x04 nothing"), "is no NPZ file"),
}


@pytest.mark.parametrize("case", CASES)
def test_what_is_refused_is_refused_before_it_is_unpacked(case, tmp_path, monkeypatch):
    assert archives.LARGEST == 512 * MB
    monkeypatch.setattr(archives, "LARGEST", 4 * MB)
    path = tmp_path / "net.npz"
    make, message = CASES[case]
    make(path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(sm.InputError, match=message) as raised:
        sm.files.read_two_parameter(path)
    assert str(raised.value).isprintable()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 30 * 1024


def test_damage_anywhere_in_an_archive_is_an_input_error_or_harmless(tmp_path):
    path = tmp_path / "net.npz"
    for save in (np.savez, np.savez_compressed):
        sm.files.write_two_parameter(smooth_net(5), path)
        with np.load(path) as arrays:
            save(path, **dict(arrays))
        whole, rng = path.read_bytes(), np.random.default_rng(1)
        for k in range(60):
            damaged = bytearray(whole)
            if k % 3:
                damaged[int(rng.integers(len(whole)))] ^= 1 << int(rng.integers(8))
            else:
                damaged = damaged[: int(rng.integers(len(whole)))]
            path.write_bytes(damaged)
            try:
                sm.files.read_two_parameter(path)
            except sm.InputError as error:
                assert "Error:" not in str(error)  # by name, not by what caught it at last

"""glTF 2.0 files taken apart: document, buffers and accessors, every claim in them checked before it is used."""

import base64
import binascii
import math
import os
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, overload
from urllib.parse import unquote

import numpy as np

from symmotion.documents import read_document
from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.gltf_document import BIN_CHUNK, JSON_CHUNK, MAGIC, VERSION
from symmotion.opening import readable_bytes

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
MOST_ZEROS = 1_000_000  # of an accessor without data
UNSIGNED = (5121, 5123, 5125)
MOST_ENTRIES = 2_000_000
MOST_ITEMS = 15_000_000  # of an accessor: bytes become doubles, eight times as large


@dataclass(frozen=True, eq=False, slots=True)
class Place:
    """A value in a document and where: a file, and the name or number of an item within the place above."""

    path: FilePath
    value: object
    above: "Place | None" = None
    name: str | int = ""

    @property
    def way(self) -> str:
        """The way in from the document's top, such as `nodes[3].rotation`."""
        if self.above is None:
            return ""
        before = self.above.way
        if isinstance(self.name, int):
            return f"{before}[{self.name}]"
        return f"{before}.{self.name}" if before else self.name

    def fault(self, message: str) -> InputError:
        """The error that names this place."""
        return InputError(f"{self.path}, {self.way}: {message}" if self.above else f"{self.path}: {message}")

    def get(self, name: str) -> "Place | None":
        """The entry of an object, or None if it has none of this name."""
        if not isinstance(self.value, dict):
            raise self.fault("an object is needed")
        return Place(self.path, self.value[name], self, name) if name in self.value else None

    def __getitem__(self, name: str) -> "Place":
        entry = self.get(name)
        if entry is None:
            raise self.fault(f"{name} is missing")
        return entry

    def items(self, name: str) -> "Items":
        """The items of the list that an entry is; none where it is left out."""
        entry = self.get(name)
        if entry is None:
            return Items(self, [])
        if not isinstance(entry.value, list):
            raise entry.fault("a list is needed")
        return Items(entry, entry.value)

    def whole(self, least: int = 0, most: float = math.inf) -> int:
        """The value as a whole number from `least` to `most`."""
        if not isinstance(self.value, float) or not self.value.is_integer() or not least <= self.value <= most:
            shown = "any" if most == math.inf else f"{most:g}"
            raise self.fault(f"{self.value!r:.40}: a whole number from {least} to {shown} is needed")
        return int(self.value)

    def of(self, items: "Items") -> "Place":
        """The item that the value is the index of."""
        if not len(items):
            raise self.fault("refers to a list that is empty or missing")
        return items[self.whole(0, len(items) - 1)]

    def text(self) -> str:
        if not isinstance(self.value, str):
            raise self.fault(f"{self.value!r:.40}: text is needed")
        return self.value

    def numbers(self, count: int) -> np.ndarray:
        """(count,) the value as a list of finite numbers."""
        value = self.value
        if not isinstance(value, list) or len(value) != count or not all(isinstance(x, float) for x in value):
            raise self.fault(f"{count} numbers are needed")
        if not all(map(math.isfinite, value)):
            raise self.fault("a number is not finite")
        return np.array(value)


class Items(Sequence[Place]):
    """The items of a list in a document, each made a place when it is asked for: there may be a hundred thousand."""

    def __init__(self, above: Place, values: list):
        self.above, self.values = above, values

    def __len__(self) -> int:
        return len(self.values)

    def __iter__(self) -> Iterator[Place]:
        path, above = self.above.path, self.above
        return (Place(path, value, above, i) for i, value in enumerate(self.values))

    @overload
    def __getitem__(self, index: int) -> Place: ...
    @overload
    def __getitem__(self, index: slice) -> list[Place]: ...
    def __getitem__(self, index: int | slice) -> Place | list[Place]:
        if isinstance(index, slice):
            return [self[i] for i in range(len(self))[index]]
        return Place(self.above.path, self.values[index], self.above, index)


@dataclass(frozen=True, eq=False)
class GltfFile:
    """A file's document, the binary chunk that a .glb has, None else, and the buffers read so far."""

    document: Place
    chunk: bytes | None
    buffers: dict[int, memoryview] = field(default_factory=dict)

    def items(self, name: str) -> Items:
        """The items of a list at the document's top."""
        return self.document.items(name)

    def accessor(self, index: Place, kinds: tuple[str, ...]) -> np.ndarray:
        """(count, width) the numbers of the accessor that `index` refers to, normalised integers as they mean.

        Those of single precision as the file has them, since they may be many, others in double. kinds: the types that
        will do. Nothing is allocated before the buffer has been found to be as large as the accessor says.
        """
        accessor = index.of(self.items("accessors"))
        kind = accessor["type"].text()
        if kind not in kinds:
            raise accessor["type"].fault(f"{kind!r:.40}: {' or '.join(kinds)} is needed")
        component = accessor["componentType"].whole()
        if component not in COMPONENTS:
            raise accessor["componentType"].fault(f"{component}: one of {', '.join(map(str, COMPONENTS))} is needed")
        number = np.dtype(COMPONENTS[component])
        count = accessor["count"].whole(1)
        if (view := accessor.get("bufferView")) is not None:
            raw, most = self._numbers(accessor, view, count, WIDTHS[kind], number), MOST_ITEMS
        else:  # zeros, which a sparse part may replace
            raw, most = np.broadcast_to(np.zeros(1), (count, WIDTHS[kind])), MOST_ZEROS
        if count > most:
            raise accessor["count"].fault(f"{count} items: {most} at most are read")
        flat = raw if number.kind == "f" and accessor.get("sparse") is None else raw.astype(float)
        if (sparse := accessor.get("sparse")) is not None:
            self._substitute(sparse, flat, number)
        normalized = accessor.get("normalized")
        if normalized is not None and normalized.value is True and number.kind in "iu":
            flat = np.maximum(flat / np.iinfo(number).max, -1.0)
        finite = np.isfinite(flat).all(axis=1)
        if not finite.all():
            raise accessor.fault(f"item {int(np.argmin(finite))} is not finite")
        return flat

    def _numbers(self, accessor: Place, index: Place, count: int, width: int, number: np.dtype) -> np.ndarray:
        """(count, width) the numbers of a view, which is found to be as large as that takes before they are."""
        view = index.of(self.items("bufferViews"))
        data, item = self._view(view), number.itemsize * width
        stride = item if (place := view.get("byteStride")) is None else place.whole(item, 252)
        offset = 0 if (place := accessor.get("byteOffset")) is None else place.whole()
        needed = offset + stride * (count - 1) + item
        if needed > len(data):
            raise accessor.fault(f"claims {needed} bytes where its buffer view has {len(data)}")
        return np.ndarray((count, width), number, data, offset, (stride, number.itemsize))

    def _substitute(self, sparse: Place, flat: np.ndarray, number: np.dtype) -> None:
        """Put the values of a sparse accessor in their places."""
        count = sparse["count"].whole(1, len(flat))
        indices, values = sparse["indices"], sparse["values"]
        component = indices["componentType"].whole()
        if component not in UNSIGNED:
            raise indices["componentType"].fault(f"{component}: one of {', '.join(map(str, UNSIGNED))} is needed")
        where = self._numbers(indices, indices["bufferView"], count, 1, np.dtype(COMPONENTS[component]))[:, 0]
        if where.max() >= len(flat) or (np.diff(where.astype(np.int64)) <= 0).any():
            raise indices.fault(f"indices that increase, below {len(flat)}, are needed")
        flat[where] = self._numbers(values, values["bufferView"], count, flat.shape[1], number)

    def _view(self, view: Place) -> memoryview:
        if (extensions := view.get("extensions")) is not None and isinstance(extensions.value, dict):
            packed = [name for name in extensions.value if "compression" in name]
            if packed:
                raise view.fault(f"{packed[0]:.60} is not read; export the animation without compression")
        length = view["byteLength"].whole(1)
        offset = 0 if (place := view.get("byteOffset")) is None else place.whole()
        data = self._buffer(view["buffer"])
        if offset + length > len(data):
            raise view.fault(f"claims bytes up to {offset + length} where its buffer has {len(data)}")
        return data[offset : offset + length]

    def _buffer(self, index: Place) -> memoryview:
        buffer, k = index.of(self.items("buffers")), index.whole()
        if k in self.buffers:
            return self.buffers[k]
        length = buffer["byteLength"].whole(1)
        uri = buffer.get("uri")
        if uri is None:
            if self.chunk is None or k != 0:
                raise buffer.fault("uri is missing, and there is no binary chunk for it")
            data = self.chunk
        else:
            data = _embedded(uri) if uri.text().startswith("data:") else _beside(uri)
        if length > len(data):
            raise buffer["byteLength"].fault(f"claims {length} bytes where there are {len(data)}")
        self.buffers[k] = memoryview(data)[:length]
        return self.buffers[k]


def open_gltf(path: FilePath) -> GltfFile:
    """The parts of a .glb (binary) or .gltf file of at most 512 MB, version 2.

    Binary is what begins as such, and what is called .glb.

    Raises InputError that names the file and the byte or entry at fault.
    """
    with readable_bytes(path) as handle:
        binary = handle.read(len(MAGIC)) == MAGIC or Path(path).suffix.lower() == ".glb"
        handle.seek(0)
        text, chunk = _chunks(path, handle) if binary else (handle.read(), None)
        # Every entry takes far more memory than it has characters; embedded data has none of these.
        if sum(text.count(mark) for mark in b"[{,") > MOST_ENTRIES:
            raise InputError(f"{path}: its document has more than {MOST_ENTRIES} entries")
        document = read_document(path, text, arrays=False)
    return GltfFile(_versioned(Place(path, document)), chunk)


def _versioned(document: Place) -> Place:
    version = document["asset"]["version"]
    if not version.text().startswith("2."):
        raise version.fault(f"{version.value!r:.40}: version 2.0 is read")
    return document


def _chunks(path: FilePath, handle: IO[bytes]) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a .glb."""
    there = handle.seek(0, os.SEEK_END)
    handle.seek(0)
    if there < 20:
        raise InputError(f"{path}: {there} bytes are too few for a .glb file")
    magic, version, length = struct.unpack("<4sII", handle.read(12))
    if magic != MAGIC:
        raise InputError(f"{path}, byte 0: {magic!r}: {MAGIC!r} begins a .glb file")
    if version != VERSION:
        raise InputError(f"{path}, byte 4: version {version}: version {VERSION} is read")
    if length != there:
        raise InputError(f"{path}, byte 8: claims {length} bytes where the file has {there}: is it cut off?")
    chunks: list[tuple[bytes, bytes]] = []
    offset = 12
    while offset < there:
        if offset + 8 > there:
            raise InputError(f"{path}, byte {offset}: a chunk begins and is cut off")
        size, name = struct.unpack("<I4s", handle.read(8))
        if offset + 8 + size > there:
            raise InputError(f"{path}, byte {offset}: a chunk claims {size} bytes, beyond the end of the file")
        chunks.append((name, handle.read(size) if len(chunks) < 2 else b""))
        offset = handle.seek(offset + 8 + size)
    if chunks[0][0] != JSON_CHUNK:
        raise InputError(f"{path}, byte 12: the first chunk is {chunks[0][0]!r}: {JSON_CHUNK!r} is needed")
    return chunks[0][1], chunks[1][1] if len(chunks) > 1 and chunks[1][0] == BIN_CHUNK else None


def _embedded(uri: Place) -> bytes:
    head, comma, body = uri.text().partition(",")
    if not comma or not head.endswith(";base64"):
        raise uri.fault("embedded data in base64 is needed, data:…;base64,…")
    try:
        return base64.b64decode(body, validate=True)
    except (binascii.Error, ValueError) as error:
        raise uri.fault(f"is no base64 ({error})") from None


def _beside(uri: Place) -> bytes:
    """The bytes of a file in the same directory or below: no other place may be read because a file says so."""
    name = unquote(uri.text())
    parts = [part for part in name.split("/") if part != "."]
    if not parts or any(part in ("", "..") or any(c in part for c in "\\:\0") for part in parts):
        raise uri.fault(f"{name!r:.60}: the name of a file in the same directory, or below, is needed")
    here = Path(uri.path).parent
    target = here.joinpath(*parts)
    if len(parts) > 1 and not target.resolve().is_relative_to(here.resolve()):
        raise uri.fault(f"{name!r:.60}: leads out of the directory")
    try:
        with readable_bytes(target) as handle:
            return handle.read()
    except InputError as error:
        raise uri.fault(str(error)) from None

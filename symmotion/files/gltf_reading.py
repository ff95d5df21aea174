"""glTF 2.0 files taken apart: document, buffers and accessors, every claim in them checked before it is used."""

import base64
import binascii
import io
import math
import struct
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from symmotion.errors import InputError
from symmotion.files.documents import read_object
from symmotion.files.formats import FilePath
from symmotion.files.gltf_document import BIN_CHUNK, JSON_CHUNK, MAGIC, VERSION
from symmotion.opening import readable_bytes

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
MOST_ZEROS = 1_000_000  # of an accessor without data
UNSIGNED = (5121, 5123, 5125)
MOST_ENTRIES = 2_000_000
MOST_ITEMS = 15_000_000  # of an accessor: bytes become doubles, eight times as large


@dataclass(frozen=True, eq=False)
class Place:
    """A value in a document and where: a file and the way in from its top, such as `nodes[3].rotation`."""

    path: FilePath
    value: object
    way: str = ""

    def fault(self, message: str) -> InputError:
        """The error that names this place."""
        return InputError(f"{self.path}, {self.way}: {message}" if self.way else f"{self.path}: {message}")

    def get(self, name: str) -> "Place | None":
        """The entry of an object, or None if it has none of this name."""
        if not isinstance(self.value, dict):
            raise self.fault("an object is needed")
        if name not in self.value:
            return None
        return Place(self.path, self.value[name], f"{self.way}.{name}" if self.way else name)

    def __getitem__(self, name: str) -> "Place":
        entry = self.get(name)
        if entry is None:
            raise self.fault(f"{name} is missing")
        return entry

    def items(self, name: str) -> list["Place"]:
        """The items of the list that an entry is; none where it is left out."""
        entry = self.get(name)
        if entry is None:
            return []
        if not isinstance(entry.value, list):
            raise entry.fault("a list is needed")
        return [Place(self.path, v, f"{entry.way}[{i}]") for i, v in enumerate(entry.value)]

    def whole(self, least: int = 0, most: float = math.inf) -> int:
        """The value as a whole number from `least` to `most`."""
        if not isinstance(self.value, float) or not self.value.is_integer() or not least <= self.value <= most:
            shown = "any" if most == math.inf else f"{most:g}"
            raise self.fault(f"{self.value!r:.40}: a whole number from {least} to {shown} is needed")
        return int(self.value)

    def of(self, items: list["Place"]) -> "Place":
        """The item that the value is the index of."""
        if not items:
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


@dataclass(frozen=True, eq=False)
class GltfFile:
    """A file's document, the binary chunk that a .glb has, None else, and the buffers read so far."""

    document: Place
    chunk: bytes | None
    buffers: dict[int, memoryview] = field(default_factory=dict)
    lists: dict[str, list[Place]] = field(default_factory=dict)

    def items(self, name: str) -> list[Place]:
        """The items of a list at the document's top, made once: each accessor asks for three."""
        if name not in self.lists:
            self.lists[name] = self.document.items(name)
        return self.lists[name]

    def accessor(self, index: Place, kinds: tuple[str, ...]) -> np.ndarray:
        """(count, width) the numbers of the accessor that `index` refers to, normalised integers as they mean.

        kinds: the types that will do. Nothing is allocated before the buffer has been found to
        be as large as the accessor says.
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
        flat = raw.astype(float)
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
        data = handle.read()
        binary = data.startswith(MAGIC) or Path(path).suffix.lower() == ".glb"
        text, chunk = _chunks(path, data) if binary else (data, None)
        # Every entry takes far more memory than it has characters; embedded data has none of these.
        if sum(text.count(mark) for mark in b"[{,") > MOST_ENTRIES:
            raise InputError(f"{path}: its document has more than {MOST_ENTRIES} entries")
        document = read_object(path, io.TextIOWrapper(io.BytesIO(text), encoding="utf-8-sig"))
    return GltfFile(_versioned(Place(path, document)), chunk)


def _versioned(document: Place) -> Place:
    version = document["asset"]["version"]
    if not version.text().startswith("2."):
        raise version.fault(f"{version.value!r:.40}: version 2.0 is read")
    return document


def _chunks(path: FilePath, data: bytes) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a .glb."""
    if len(data) < 20:
        raise InputError(f"{path}: {len(data)} bytes are too few for a .glb file")
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != MAGIC:
        raise InputError(f"{path}, byte 0: {magic!r}: {MAGIC!r} begins a .glb file")
    if version != VERSION:
        raise InputError(f"{path}, byte 4: version {version}: version {VERSION} is read")
    if length != len(data):
        raise InputError(f"{path}, byte 8: claims {length} bytes where the file has {len(data)}: is it cut off?")
    chunks: list[tuple[bytes, bytes]] = []
    offset = 12
    while offset < len(data):
        if offset + 8 > len(data):
            raise InputError(f"{path}, byte {offset}: a chunk begins and is cut off")
        size, name = struct.unpack_from("<I4s", data, offset)
        if offset + 8 + size > len(data):
            raise InputError(f"{path}, byte {offset}: a chunk claims {size} bytes, beyond the end of the file")
        chunks.append((name, data[offset + 8 : offset + 8 + size]))
        offset += 8 + size
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

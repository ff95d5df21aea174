"""glTF 2.0 documents under construction, and their binary form (.glb)."""

import json
import struct
from typing import Any

import numpy as np

# glTF's numbers for component types and for what a buffer view is used as.
COMPONENTS = {np.dtype("<u1"): 5121, np.dtype("<u2"): 5123, np.dtype("<u4"): 5125, np.dtype("<f4"): 5126}
VERTICES, INDICES = 34962, 34963
MAGIC, VERSION, JSON_CHUNK, BIN_CHUNK = b"glTF", 2, b"JSON", b"BIN\0"


class DocumentBuilder:
    """A document that grows: `accessor` puts arrays into its one buffer, the other lists are the caller's to fill."""

    def __init__(self, notes: dict[str, object]):
        self.entries: dict[str, Any] = {  # Any: JSON
            "asset": {"version": "2.0", "generator": "symmotion", "extras": notes},
            "accessors": [],
            "bufferViews": [],
        }
        self._binary = bytearray()

    def accessor(
        self, array: np.ndarray, kind: str, component: str = "<f4", target: int | None = None, bounds: bool = False
    ) -> int:
        """The index of a new accessor for an array (N, …) of `kind` SCALAR, VEC3, VEC4 or MAT4."""
        flat = np.ascontiguousarray(array, dtype=component).reshape(len(array), -1)
        view = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": flat.nbytes}
        self._binary += flat.tobytes()
        self._binary += bytes(-len(self._binary) % 4)
        entry = {
            "bufferView": len(self.entries["bufferViews"]),
            "componentType": COMPONENTS[np.dtype(component)],
            "count": len(flat),
            "type": kind,
        }
        if bounds:
            entry |= {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        self.entries["bufferViews"].append(view if target is None else view | {"target": target})
        self.entries["accessors"].append(entry)
        return len(self.entries["accessors"]) - 1

    def glb(self) -> bytes:
        """The document as a binary file."""
        text = json.dumps(
            self.entries | {"buffers": [{"byteLength": len(self._binary)}]}, ensure_ascii=False, allow_nan=False
        ).encode()
        text += b" " * (-len(text) % 4)
        chunks = b"".join(
            struct.pack("<I", len(data)) + name + data
            for name, data in ((JSON_CHUNK, text), (BIN_CHUNK, bytes(self._binary)))
        )
        return struct.pack("<4sII", MAGIC, VERSION, 12 + len(chunks)) + chunks

"""A glTF or GLB file's JSON, and the numbers and images that it points to. Source: glTF 2.0, sections 3.6, 3.8 and 4.4.

trimesh, the authority in the tests, rounds colours to 8 bits, spoils quantised texture coordinates and reads one set of
them.
"""

import base64
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import InputError
from spin_usd.files.given_file import read_bytes
from spin_usd.files.model_root import root_of
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.formats.mesh.gltf_meshopt import MESHOPT, decoded_view
from spin_usd.formats.texture_file import texture_beside, texture_of
from spin_usd.nesting import parsed_json
from spin_usd.scene.shape import MAX_FACES
from spin_usd.scene.source.asset import ImageFile

GLB_MAGIC = b"glTF"
BIN = 0x004E4942
TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
MAX_ELEMENTS = 3 * MAX_FACES


@dataclass(frozen=True)
class Document:
    """`json` as the file has it, `binary` the GLB's own buffer. Whoever reads from it must expect damaged files: any
    built-in error of look-ups and arithmetic."""

    path: Path
    json: dict[str, Any]
    binary: bytes

    def entries(self, name: str) -> list[dict[str, Any]]:
        """Return the top-level array `name`, empty where there is none."""
        found: list[dict[str, Any]] = self.json.get(name, [])
        return found

    def values(self, index: int, decoded: Mapping[int, NDArray[Any]] = MappingProxyType({})) -> NDArray[Any]:
        """Return (count, width) of an accessor, or of what `decoded` has in its place: float64 for floats and
        normalised integers, else its own integers."""
        accessor = at(self.entries("accessors"), index)
        values = decoded[index] if index in decoded else self._stored(index, accessor)
        if values.dtype.kind == "f":
            return values.astype(np.float64)
        return _normalised(values) if accessor.get("normalized") else values

    def _stored(self, index: int, accessor: dict[str, Any]) -> NDArray[Any]:
        kind, count = np.dtype(TYPES[accessor["componentType"]]).newbyteorder("<"), accessor["count"]
        width = WIDTHS[accessor["type"]]
        if not 0 < count <= MAX_ELEMENTS:
            raise ValueError(f"accessor {index} has {count} elements")
        values = np.zeros((count, width), kind)
        if "bufferView" in accessor:
            values = self._strided(accessor["bufferView"], accessor.get("byteOffset", 0), kind, count, width)
        if sparse := accessor.get("sparse"):
            values = values.copy()
            values[self._sparse(sparse["indices"], sparse["count"], 1)[:, 0]] = self._sparse(
                sparse["values"] | {"componentType": accessor["componentType"]}, sparse["count"], width
            )
        return values

    def image(self, index: int) -> ImageFile:
        """Return an image, from its file beside this one, its data URI or its part of a buffer. InputError says why
        not."""
        if index not in self._decoded:
            self._decoded[index] = self._image(index)
        return self._decoded[index]

    @cached_property
    def _decoded(self) -> dict[int, ImageFile]:
        return {}

    def _image(self, index: int) -> ImageFile:
        entry = at(self.entries("images"), index)
        name = str(entry.get("name") or f"{self.path.stem}_{index}")
        if "bufferView" in entry:
            return texture_of(name, self.view(entry["bufferView"]))
        if (data := _data_uri(entry["uri"])) is not None:
            return texture_of(name, data)
        return texture_beside(self.path, unquote(entry["uri"]), root_of(self.path))

    def view(self, index: int) -> bytes:
        """Return the bytes of a buffer view, decompressed."""
        if index not in self._views:
            view = at(self.entries("bufferViews"), index)
            packed = view.get("extensions", {}).get(MESHOPT)
            stored = packed or view
            start, length = stored.get("byteOffset", 0), stored["byteLength"]
            data = self.buffer(stored["buffer"])
            if start < 0 or length < 0 or start + length > len(data):
                raise ValueError(f"buffer view {index} reaches beyond its buffer")
            data = data[start : start + length]
            self._views[index] = decoded_view(packed, data) if packed else data
        return self._views[index]

    @cached_property
    def _views(self) -> dict[int, bytes]:
        return {}

    def _strided(self, view: int, offset: int, kind: np.dtype[Any], count: int, width: int) -> NDArray[Any]:
        data, item = self.view(view), kind.itemsize * width
        stride = self.entries("bufferViews")[view].get("byteStride", item)
        if offset < 0 or stride < item or offset + (count - 1) * stride + item > len(data):
            raise ValueError(f"an accessor reaches beyond buffer view {view}")
        return np.ndarray((count, width), kind, data, offset, (stride, kind.itemsize))

    def _sparse(self, part: dict[str, Any], count: int, width: int) -> NDArray[Any]:
        kind = np.dtype(TYPES[part["componentType"]]).newbyteorder("<")
        return self._strided(part["bufferView"], part.get("byteOffset", 0), kind, count, width)

    def buffer(self, index: int) -> bytes:
        """Return the bytes of a buffer, from its file beside this one where it has one."""
        if index not in self._buffers:
            self._buffers[index] = self._buffer(at(self.entries("buffers"), index), index)
        return self._buffers[index]

    @cached_property
    def _buffers(self) -> dict[int, bytes]:
        return {}

    def _buffer(self, entry: dict[str, Any], index: int) -> bytes:
        if "uri" not in entry:
            if index:  # the GLB's own is the first; others are placeholders of what is compressed elsewhere
                raise ValueError(f"buffer {index} has no data")
            return self.binary
        if (data := _data_uri(entry["uri"])) is not None:
            return data
        full = (self.path.parent / unquote(entry["uri"])).resolve()
        if not full.is_relative_to(root_of(self.path)):
            raise InputError(f"its buffer {entry['uri']!r} lies outside the model's folder", where=self.path)
        return read_bytes(full, MAX_MODEL)


def read_document(path: Path) -> Document:
    """Read the file at `path`. Raises InputError, or a kind of ValueError for a file that is not glTF 2.0."""
    data, binary = read_bytes(path, MAX_MODEL), b""
    if data[:4] == GLB_MAGIC:
        (length,) = struct.unpack_from("<I", data, 12)
        data, rest = data[20 : 20 + length], data[20 + length :]
        if len(rest) >= 8 and struct.unpack_from("<I", rest, 4)[0] == BIN:
            binary = rest[8 : 8 + struct.unpack_from("<I", rest)[0]]
    found = parsed_json(data)
    if not isinstance(found, dict) or not str(found["asset"]["version"]).startswith("2"):
        raise InputError("is not of glTF's version 2", where=path, do="convert it to glTF 2.0")
    return Document(path, found, binary)


def _data_uri(uri: str) -> bytes | None:
    head, comma, body = uri.partition(",")
    if not (head.startswith("data:") and comma):
        return None
    return base64.b64decode(body) if head.endswith(";base64") else unquote(body).encode("latin-1")


def _normalised(values: NDArray[Any]) -> NDArray[np.float64]:
    return np.asarray(np.maximum(values / np.float64(np.iinfo(values.dtype).max), -1.0))


def at(entries: list[dict[str, Any]], index: int) -> dict[str, Any]:
    if not 0 <= index < len(entries):  # a list would count a negative index from its end
        raise IndexError(f"{index} of {len(entries)}")
    return entries[index]

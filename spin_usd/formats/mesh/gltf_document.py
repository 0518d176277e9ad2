"""A glTF or GLB file's JSON, and the numbers and images that it points to.

Source: glTF 2.0, sections 3.6, 3.8 and 4.4. trimesh, the authority in the tests, rounds colours to 8 bits, spoils
quantised texture coordinates and reads one set of them.
"""

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.model_root import root_of
from spin_usd.files.size_limits import GLTF_ENTRIES, MAX_MODEL, MAX_UNSTORED
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.mesh.gltf_json import JsonObject, parsed_object
from spin_usd.formats.mesh.gltf_meshopt import MESHOPT, Compressed, decoded_view
from spin_usd.formats.referenced_file import file_within, name_of
from spin_usd.formats.texture_file import texture_beside, texture_of
from spin_usd.scene.asset import ImageFile
from spin_usd.scene.shape import MAX_FACES

GLB_MAGIC, GLB_HEAD = b"glTF", 20  # with the head of the first chunk
BIN = 0x004E4942
TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
MAX_ELEMENTS = 3 * MAX_FACES


@dataclass(frozen=True)
class Document:
    """`json` is the file's, `binary` the GLB's own buffer. All methods raise InputError for damaged files."""

    path: Path
    json: JsonObject
    binary: bytes | memoryview

    def entries(self, name: str) -> list[JsonObject]:
        """Return the top-level array `name`, empty if missing."""
        if name not in self._entries:
            self._entries[name] = self.json.objects(name, GLTF_ENTRIES[name])
        return self._entries[name]

    @cached_property
    def _entries(self) -> dict[str, list[JsonObject]]:
        return {}

    def entry(self, name: str, index: int) -> JsonObject:
        """Return an entry of the top-level array `name`."""
        entries = self.entries(name)
        if index >= len(entries):
            raise self.json.damaged(f"something in it refers to {name}[{index}], of which there are {len(entries)}")
        return entries[index]

    def primitives(self, mesh: JsonObject) -> list[JsonObject]:
        return mesh.objects("primitives", GLTF_ENTRIES["primitives"])

    def values(
        self,
        index: int,
        widths: tuple[int, ...],
        decoded: Mapping[int, NDArray[Any]] = MappingProxyType({}),
        *,
        whole: bool = False,
    ) -> NDArray[Any]:
        """Return (count, width) of an accessor, or of its replacement in `decoded`: float64 for floats and normalised
        integers, else its own integers. The width is one of `widths`; `whole` requires integers."""
        accessor = self.entry("accessors", index)
        values = decoded[index] if index in decoded else self._stored(accessor)
        if values.shape[1] not in widths:
            raise accessor.damaged(f"{accessor.place} has {values.shape[1]} numbers an element, expected {widths[0]}")
        if whole and values.dtype.kind == "f":
            raise accessor.damaged(f"{accessor.place} has fractions where whole numbers are expected")
        if values.dtype.kind == "f":
            return values.astype(np.float64)
        return _normalised(values) if not whole and accessor.flag("normalized", False) else values

    def _stored(self, accessor: JsonObject) -> NDArray[Any]:
        kind, count = _kind(accessor), accessor.whole("count")
        width = WIDTHS.get(accessor.text("type", ""))
        if width is None:
            raise accessor.wrong("type", f"one of {', '.join(WIDTHS)}")
        stored = "bufferView" in accessor
        if not 0 < count <= (MAX_ELEMENTS if stored else MAX_UNSTORED):
            raise accessor.damaged(f"{accessor.place} has {count} elements, expected 1 to {MAX_ELEMENTS}")
        if not stored:
            values: NDArray[Any] = np.zeros((count, width), kind)
        else:
            values = self._strided(accessor, kind, count, width)
        if "sparse" in accessor:
            sparse = accessor.object("sparse")
            some = sparse.whole("count")
            if not 0 < some <= count:
                raise sparse.wrong("count", f"1 to {count}")
            indices = sparse.object("indices")
            at = self._strided(indices, _kind(indices), some, 1)[:, 0]
            if at.dtype.kind == "f" or at.min() < 0 or at.max() >= count:
                raise indices.damaged(f"{indices.place} reaches beyond the {count} elements")
            values = values.copy()
            values[at] = self._strided(sparse.object("values"), kind, some, width)
        return values

    def image(self, index: int) -> ImageFile:
        """Return an image, from its file beside this one, its data URI or its part of a buffer. Raises InputError with
        the reason."""
        if index not in self._decoded:
            self._decoded[index] = self._image(index)
        return self._decoded[index]

    @cached_property
    def _decoded(self) -> dict[int, ImageFile]:
        return {}

    def _image(self, index: int) -> ImageFile:
        entry = self.entry("images", index)
        name, uri = entry.text("name", f"{self.path.stem}_{index}"), entry.text("uri", "")
        if "bufferView" in entry:
            return texture_of(name, bytes(self.view(entry.whole("bufferView"))))
        if (data := _data_uri(uri, f"{self.path}, {entry.place}")) is not None:
            return texture_of(name, data)
        return texture_beside(self.path, self._named(uri), root_of(self.path))

    def _named(self, uri: str) -> str:
        return name_of(uri, root_of(self.path), self.path.parent)

    def view(self, index: int) -> memoryview:
        """Return the bytes of a buffer view, decompressed."""
        if index not in self._views:
            view = self.entry("bufferViews", index)
            extensions = view.object("extensions")
            stored = extensions.object(MESHOPT) if MESHOPT in extensions else view
            start, length = stored.whole("byteOffset", 0), stored.whole("byteLength")
            data = memoryview(self.buffer(stored.whole("buffer")))
            if start + length > len(data):
                raise view.damaged(f"{view.place} reaches to byte {start + length} of the {len(data)} of its buffer")
            data = data[start : start + length]
            self._views[index] = self._decompressed(stored, bytes(data)) if MESHOPT in extensions else data
        return self._views[index]

    def _decompressed(self, said: JsonObject, data: bytes) -> memoryview:
        whole = Compressed(
            count=said.whole("count"),
            stride=said.whole("byteStride"),
            mode=said.text("mode", ""),
            filter=said.text("filter", "NONE"),
        )
        with decoding(f"{self.path}, {said.place}"):
            return memoryview(decoded_view(whole, data))

    @cached_property
    def _views(self) -> dict[int, memoryview]:
        return {}

    def _strided(self, part: JsonObject, kind: np.dtype[Any], count: int, width: int) -> NDArray[Any]:
        """Return (count, width) of an accessor or a part of it, which gives their place in a view."""
        view, offset, item = part.whole("bufferView"), part.whole("byteOffset", 0), kind.itemsize * width
        data = self.view(view)
        stride = self.entry("bufferViews", view).whole("byteStride", 0) or item
        if stride < item or offset + (count - 1) * stride + item > len(data):
            raise part.damaged(f"{part.place} reaches beyond the {len(data)} bytes of bufferViews[{view}]")
        return np.ndarray((count, width), kind, data, offset, (stride, kind.itemsize))

    def buffer(self, index: int) -> bytes | memoryview:
        """Return the bytes of a buffer, from its file beside this one where it has one."""
        if index not in self._buffers:
            self._buffers[index] = self._buffer(self.entry("buffers", index), index)
        return self._buffers[index]

    @cached_property
    def _buffers(self) -> dict[int, bytes | memoryview]:
        return {}

    def _buffer(self, entry: JsonObject, index: int) -> bytes | memoryview:
        uri = entry.text("uri", "")
        if not uri:
            if index:  # the GLB's own is the first; others are placeholders for compressed buffers
                raise entry.damaged(f"{entry.place} has no data")
            return self.binary
        if (data := _data_uri(uri, f"{self.path}, {entry.place}")) is not None:
            return data
        full = file_within(root_of(self.path), self.path.parent, self._named(uri))
        if full is None:
            raise InputError(f"its buffer {uri!r} lies outside the model's folder", where=self.path)
        return read_bytes(full, MAX_MODEL)

    def buffers_beside(self) -> dict[str, bytes]:
        """Return the bytes of each buffer with a URI, by that URI."""
        named = ((entry.text("uri", ""), index) for index, entry in enumerate(self.entries("buffers")))
        return {uri: bytes(self.buffer(index)) for uri, index in named if uri}


def read_document(path: Path) -> Document:
    """Read the file at `path`. Raises InputError."""
    data = read_bytes(path, MAX_MODEL)
    binary: bytes | memoryview = b""
    if data.startswith(GLB_MAGIC):
        length = int.from_bytes(data[12:16], "little")
        rest = memoryview(data)[GLB_HEAD + length :]  # no copy, since it may be large
        data = data[GLB_HEAD : GLB_HEAD + length]
        if int.from_bytes(rest[4:8], "little") == BIN:
            binary = rest[8 : 8 + int.from_bytes(rest[:4], "little")]
    found = parsed_object(data, path)
    try:
        version = found.object("asset").text("version", "")
    except InputError:  # of the first version it often is a number
        version = ""
    if not version.startswith("2"):
        raise InputError("is not of glTF's version 2", where=path, do="convert it to glTF 2.0")
    return Document(path, found, binary)


def _kind(part: JsonObject) -> np.dtype[Any]:
    number = part.whole("componentType")
    if number not in TYPES:
        raise part.wrong("componentType", f"one of {', '.join(map(str, TYPES))}")
    return np.dtype(TYPES[number]).newbyteorder("<")


def _data_uri(uri: str, where: str) -> bytes | None:
    head, comma, body = uri.partition(",")
    if not (head.startswith("data:") and comma):
        return None
    with decoding(where):
        return base64.b64decode(body) if head.endswith(";base64") else unquote(body).encode("latin-1")


def _normalised(values: NDArray[Any]) -> NDArray[np.float64]:
    return np.asarray(np.maximum(values / np.float64(np.iinfo(values.dtype).max), -1.0))

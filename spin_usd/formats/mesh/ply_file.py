"""PLY, parsed by plyfile: polygons or triangle strips, normals, colours and texture coordinates.

trimesh reads PLY too, but cuts polygons, merges corners, reads no strips and refuses binary files of triangles among
quads; it serves as the authority in the tests. The format names only a point's properties; other names are as exporters
write them. A texture is named by MeshLab's comment `TextureFile`.
"""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from plyfile import PlyData, PlyElement

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.model_root import root_of
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.mesh.vertex_colors import with_colors
from spin_usd.formats.text_file import refuse_long_lines
from spin_usd.formats.texture_file import color_space, texture_beside
from spin_usd.geometry.triangles import strip_triangles
from spin_usd.scene.asset import ImageMap, MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.material import Material

ST, TEXTURE = "st", "texturefile "
END, MAX_HEADER = b"end_header", 2**18
KEYWORDS = (b"ply", b"format", b"comment", b"obj_info", b"element", b"property")
INDICES = ("vertex_indices", "vertex_index")
COLORS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
SIZES = dict.fromkeys((b"short", b"ushort", b"int16", b"uint16"), 2) | {b"double": 8, b"float64": 8}
SIZES |= dict.fromkeys((b"int", b"uint", b"float", b"int32", b"uint32", b"float32"), 4)
TEXT_SIZES = dict.fromkeys((*SIZES, b"char", b"uchar", b"int8", b"uint8"), 2)
"""Bytes of a value in a binary file, and at the least in text; else 1."""
NORMALS = (("nx", "ny", "nz"),)


@dataclass(frozen=True, kw_only=True, eq=False)
class _PlyFaces:
    """Faces of any number of corners."""

    indices: NDArray[np.int64]
    """(C,): the points of the corners."""
    counts: NDArray[np.int64]
    """(F,)."""
    colors: Float | None = None
    """(C, 3), where the faces have their own."""
    st: Float | None = None
    """(C, 2), where the faces have their own."""


def read_ply(path: Path) -> MeshAsset:
    """Read the model in the file's own units. Raises InputError that names the file, GeometryError."""
    text = _with_plain_header(read_bytes(path, MAX_MODEL), path)
    with decoding(path):
        data = PlyData.read(io.BytesIO(text))
        faces = _faces(data)
        points = _columns(data["vertex"], (("x", "y", "z"),))
        part = None if points is None or not len(faces.counts) else _part(path.stem, points, faces)
        values = [] if part is None else [_at_corners(data["vertex"], faces, n) for n in (NORMALS, COLORS, COORDINATES)]
    if part is None:
        raise InputError("holds no faces", where=path)
    normals, colors, st = values
    st, colors = (st if faces.st is None else faces.st), (faces.colors if colors is None else colors)
    part = replace(part, normals=normals, primvars={} if st is None else {ST: st})
    material, notes = _material(path, data, st is not None)
    if material:
        part = replace(part, face_material=np.zeros(len(faces.counts), np.int32))
    asset = MeshAsset(name=path.stem, parts=(part,), materials=(material,) if material else (), notes=notes)
    return with_colors(asset, [colors])


def _with_plain_header(data: bytes, path: Path) -> bytes:
    """Return the file with each header line that the format does not know made a comment: Blender 2.47 wrote its name
    so. Raises InputError for a header without an end, or that counts more than the file can hold, and endless lines."""
    end = data.find(END, 0, MAX_HEADER)
    if end < 0:
        found = f"has no {END.decode()} among its first {MAX_HEADER} bytes"
        if not data.startswith(KEYWORDS[0]):
            found = "is not a PLY file" if data else "is empty"
        raise InputError(found, where=path, do="give a PLY file, as its exporter wrote it")
    lines = data[:end].splitlines(keepends=True)
    least, ascii_ = _least_bytes(lines), any(line.split()[:2] == [b"format", b"ascii"] for line in lines)
    if least > len(data) - end:
        found = f"counts points and faces of {least} bytes at least, and has {len(data) - end} for them"
        raise InputError(found, where=path, do="copy or export it again")
    if ascii_:
        refuse_long_lines(data, path)
    commented = [line if line.split()[:1] and line.split()[0] in KEYWORDS else b"comment " + line for line in lines]
    return b"".join([*commented, data[end:]])


def _least_bytes(lines: list[bytes]) -> int:
    """Return the least number of bytes that the header implies: in text a digit and a separator for each value; for a
    list its count."""
    total = rows = 0
    sizes: Mapping[bytes, int] = {}
    for line in lines:
        match line.split():
            case [b"format", kind, *_]:
                sizes = TEXT_SIZES if kind == b"ascii" else SIZES
            case [b"element", _, count] if count.isdigit():
                rows = int(count)
            case [b"property", b"list", kind, *_] | [b"property", kind, *_]:
                total += rows * sizes.get(kind, 1)
    return total


def _part(name: str, points: Float, faces: _PlyFaces) -> MeshPart:
    return MeshPart(
        name=name,
        points=points,
        face_counts=faces.counts.astype(np.int32),
        face_indices=faces.indices.astype(np.int32),
        normals=None,
        face_material=np.full(len(faces.counts), -1, np.int32),
    )


def _faces(data: PlyData) -> _PlyFaces:
    """Return the file's polygons, or the triangles of its strips; polygons of fewer than three corners are skipped."""
    if "face" in data and data["face"].count:
        element = data["face"]
        lists = _lists(element, INDICES)
        keep = np.array([len(corners) > 2 for corners in lists])
        counts = np.array([len(corners) for corners in lists], np.int64)[keep]
        if not len(counts):
            return _PlyFaces(indices=counts, counts=counts)
        colors = _columns(element, COLORS)
        return _PlyFaces(
            indices=np.concatenate([lists[i] for i in np.flatnonzero(keep)]).astype(np.int64),
            counts=counts,
            colors=None if colors is None else np.repeat(colors[keep], counts, axis=0),
            st=_corner_coordinates(element, keep, counts),
        )
    strips = [np.asarray(strip) for strip in _lists(data["tristrips"], INDICES)] if "tristrips" in data else []
    triangles = np.concatenate([np.zeros((0, 3), np.int64), *(strip_triangles(strip) for strip in strips)])
    return _PlyFaces(indices=triangles.ravel(), counts=np.full(len(triangles), 3, np.int64))


def _corner_coordinates(element: PlyElement, keep: NDArray[np.bool_], counts: NDArray[np.int64]) -> Float | None:
    """Return (C, 2) of the property texcoord, u and v of each corner after another, as MeshLab writes it; None without
    it."""
    if "texcoord" not in _names(element):
        return None
    lists = [np.asarray(values, np.float64) for values, kept in zip(element["texcoord"], keep, strict=True) if kept]
    whole = all(len(values) == 2 * count for values, count in zip(lists, counts, strict=True))
    return np.concatenate(lists).reshape(-1, 2) if whole else None


def _at_corners(vertices: PlyElement, faces: _PlyFaces, choices: tuple[tuple[str, ...], ...]) -> Float | None:
    values = _columns(vertices, choices)
    return None if values is None else values[faces.indices]


def _columns(element: PlyElement, choices: tuple[tuple[str, ...], ...]) -> Float | None:
    """Return (N, C) of the first of `choices` whose properties the element all has, of whole colours the share of
    white."""
    for names in choices:
        if set(names) <= _names(element):
            columns = [np.asarray(element[name]) for name in names]
            values = np.stack(columns, axis=1).astype(np.float64)
            return values / _white(columns) if choices is COLORS and columns[0].dtype.kind in "iu" else values
    return None


def _white(columns: Sequence[NDArray[Any]]) -> int:
    """Return the value of a full colour: 255, which many write into wider numbers too, or the largest number of the
    type."""
    most = max((int(column.max()) for column in columns if column.size), default=0)
    return 255 if most <= 255 else int(np.iinfo(columns[0].dtype).max)


def _lists(element: PlyElement, names: tuple[str, ...]) -> NDArray[Any]:
    """Return the lists (N,) of the first of `names` that the element has."""
    name = next(name for name in names if name in _names(element))
    return np.asarray(element[name])


def _names(element: PlyElement) -> set[str]:
    return {prop.name for prop in element.properties}


def _material(path: Path, data: PlyData, mapped: bool) -> tuple[ModelMaterial | None, tuple[str, ...]]:
    """Return the material that shows the file's first texture, and notes."""
    comments = [str(comment) for comment in (*data.comments, *data.obj_info)]
    named = [comment[len(TEXTURE) :].strip() for comment in comments if comment.lower().startswith(TEXTURE)]
    if not named or not mapped:
        return None, ("its texture coordinates are kept as the primvar st, and it names no image",) if mapped else ()
    notes = [f"of its {len(named)} textures only the first, {named[0]!r}, is carried over"] if len(named) > 1 else []
    try:
        file = texture_beside(path, named[0], root_of(path))
    except InputError as error:
        return None, (*notes, error.found)
    image = ImageMap(file=file, color_space=color_space(file))
    return ModelMaterial(constants=Material(path="texture"), images={"diffuseColor": image}), tuple(notes)

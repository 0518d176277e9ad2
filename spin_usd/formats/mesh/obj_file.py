"""Wavefront OBJ and MTL, as stored: polygons, corner normals and texture coordinates, a material per face, groups in
file order.

trimesh reads OBJ too, but cuts polygons, merges corners into vertices and keeps one material per group; it serves as
the authority in the tests. Source: P. Bourke, "Object Files (.obj)", "MTL material format".
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.pluralise import pluralise
from spin_usd.errors import InputError
from spin_usd.files.model_root import root_of
from spin_usd.files.size_limits import MAX_MODEL, MAX_TABLE
from spin_usd.formats.mesh.mtl_file import read_mtl
from spin_usd.formats.mesh.vertex_colors import white, with_colors
from spin_usd.formats.referenced_file import file_within
from spin_usd.formats.text_file import MAX_LINE, lines_of
from spin_usd.geometry.triangles import unit_vectors
from spin_usd.scene.asset import MAX_PARTS, MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.material import Material

ST = "st"
NAMING = {"o", "g", "usemtl", "mtllib"}  # whose names may hold a #
LOST = 2**31  # an index before the first
NO_NAMES = {"", "default", "off"}  # group names that exporters write for "no group"


@dataclass
class _ObjFaces:
    """The faces of one part while the file is read: corners as (point, coordinates, normal), -1 for a missing one."""

    name: str
    counts: list[int] = field(default_factory=list)
    corners: list[tuple[int, int, int]] = field(default_factory=list)
    materials: list[int] = field(default_factory=list)
    smoothing: list[int] = field(default_factory=list)
    """The group within which a face is smooth, 0 where it is flat."""

    def without_lost(self, coordinates: int, normals: int) -> int:
        """Remove the indices that the file's numbers of coordinates and normals do not reach; return how many corners
        had some."""
        ends = coordinates, normals
        bad = [any(index >= end for index, end in zip(each[1:], ends, strict=True)) for each in self.corners]
        if any(bad):
            self.corners = [(p, t if t < coordinates else -1, n if n < normals else -1) for p, t, n in self.corners]
        return sum(bad)


def read_obj(path: Path) -> MeshAsset:
    """Read the model in the file's own units. Raises InputError that names the file and the line."""
    points: list[list[float]] = []
    normals: list[list[float]] = []
    coordinates: list[list[float]] = []
    parts: dict[tuple[str, str], _ObjFaces] = {}
    materials: dict[str, int] = {}
    libraries: list[str] = []
    colors: list[list[float]] = []
    smoothings = {"off": 0, "0": 0, "": 0}
    group, material, smoothing = ("", ""), -1, 0
    for where, key, rest in _statements(path):
        if key == "v":
            points.append(_vector(rest, where))
            colors.append(_color(rest, where))
        elif key == "vn":
            normals.append(_vector(rest, where))
        elif key == "vt":
            coordinates.append(_coordinates(rest, where))
        elif key == "f":
            if group not in parts:
                parts[group] = _ObjFaces(path.stem)
            faces = parts[group]
            if len(parts) > MAX_PARTS:
                many = f"has more than {MAX_PARTS} objects and groups"
                raise InputError(many, where=path, do="join the faces of one part")
            counts = len(points), len(coordinates), len(normals)
            corners = [_corner(text, counts, where) for text in rest.split()]
            if len(corners) < 3:
                raise InputError(f"a face has {len(corners)} corners, expected 3 or more", where=where)
            faces.counts.append(len(corners))
            faces.corners += corners
            faces.materials.append(material)
            faces.smoothing.append(smoothing)
        elif key == "o":
            group = (rest, "")
        elif key == "g":
            group = (group[0], rest)
        elif key == "s":
            smoothing = smoothings.setdefault(rest.strip().lower(), len(smoothings))
        elif key == "usemtl":
            material = materials.setdefault(rest, len(materials))
        elif key == "mtllib":
            libraries.append(rest)
    if not parts:
        raise InputError("holds no faces", where=path)
    found, notes = read_materials(path, list(materials), libraries)
    xyz, directions = np.array(points, np.float64).reshape(-1, 3), np.array(normals, np.float64).reshape(-1, 3)
    st = np.array(coordinates, np.float64).reshape(-1, 2)
    lost = sum(each.without_lost(len(st), len(directions)) for each in parts.values())
    if lost:
        named = "texture coordinates or normals that the file does not have: it is read without these"
        notes = (*notes, f"{pluralise(lost, 'corner')} of its faces have {named}")
    for (own, divided), faces in parts.items():  # a group divides an object, or repeats its name
        only = [name for name, _ in parts].count(own) == 1 and own.lower() not in NO_NAMES
        faces.name = _part_name((own, "" if only else divided), path)
    asset = MeshAsset(
        name=path.stem,
        parts=_smoothed([_part(each, xyz, st, directions) for each in parts.values()], list(parts.values())),
        materials=found,
        notes=notes,
    )
    asset = _plain_where_unmapped(asset, list(parts.values()))
    return with_colors(asset, _corner_colors(colors, list(parts.values())))


def _statements(path: Path) -> Iterator[tuple[str, str, str]]:
    """Yield (where, keyword, rest) of every line with content; a backslash continues a line. Raises InputError for a
    line of more than MAX_LINE characters in all."""
    pending: list[str] = []
    length = 0
    for number, line in enumerate(lines_of(path, MAX_MODEL), 1):
        line = "" if line.lstrip().startswith("#") else line.strip()
        pending.append(line.removesuffix("\\"))
        length += len(line)
        if length > MAX_LINE:
            do = "look for backslashes that end lines"
            raise InputError(f"continues for more than {MAX_LINE} characters", where=f"{path}, line {number}", do=do)
        if line.endswith("\\"):
            continue
        line, pending, length = " ".join(pending), [], 0
        if line.strip():
            key, *rest = line.split(None, 1)
            yield f"{path}, line {number}", key, "".join(rest) if key in NAMING else "".join(rest).partition("#")[0]


def _vector(rest: str, where: str) -> list[float]:
    try:
        x, y, z = (float(text) for text in rest.split()[:3])
    except ValueError:
        raise InputError(f"{rest[:60]!r} is not three numbers", where=where) from None
    return [x, y, z]


def _color(rest: str, where: str) -> list[float]:
    """r, g and b of "x y z r g b", which the format does not define and many write; empty without: "x y z w" is a
    rational curve's."""
    fields = rest.split()[3:6]
    return _vector(" ".join(fields), where) if len(fields) == 3 else []


def _corner_colors(colors: list[list[float]], parts: list[_ObjFaces]) -> list[Float | None]:
    """sRGB (C, 3) at the corners of each part, white for points without; None for all where no point has one."""
    if not any(colors):
        return [None] * len(parts)
    missing = [white(np.array([color for color in colors if color]))] * 3
    whole = np.array([color or missing for color in colors])
    return [whole[[point for point, _, _ in part.corners]] for part in parts]


def _coordinates(rest: str, where: str) -> list[float]:
    """u and v of "u", "u v" or "u v w": v is 0 if missing."""
    try:
        u, v = (float(text) for text in [*rest.split(), "0"][:2])
    except ValueError:
        raise InputError(f"{rest[:60]!r} are not texture coordinates", where=where) from None
    return [u, v]


def _corner(text: str, counts: tuple[int, int, int], where: str) -> tuple[int, int, int]:
    """Indices from 0 of "v", "v/vt", "v//vn" or "v/vt/vn"; negative ones count back from the latest of `counts`. Those
    of coordinates and normals may be out of range."""
    fields = [*text.split("/"), "", ""][:3]
    found = []
    for field_text, count, what in zip(fields, counts, ("point", "texture coordinate", "normal"), strict=True):
        try:
            index = int(field_text) if field_text or what == "point" else 0
        except ValueError:
            raise InputError(f"{text[:40]!r} is not a face's corner", where=where) from None
        index += count if index < 0 else -1
        if what != "point" and (index < -1 or (index == -1 and field_text)):
            index = LOST
        elif what == "point" and not 0 <= index < count:
            found_text = f"a face has {what} {text[:40]!r} of {count}"
            raise InputError(found_text, where=where, do="the index is out of range")
        found.append(index)
    return found[0], found[1], found[2]


def _part_name(group: tuple[str, str], path: Path) -> str:
    names = [name for name in group if name.lower() not in NO_NAMES]
    return " ".join(names) or path.stem


def _part(faces: _ObjFaces, points: Float, st: Float, normals: Float) -> MeshPart:
    """Return the part with only the points that it uses, in their order in the file; st is 0 where a corner has
    none."""
    corners = np.array(faces.corners, np.int64)
    used, indices = np.unique(corners[:, 0], return_inverse=True)
    has_normals = bool((corners[:, 2] >= 0).all())
    mapped = corners[:, 1] >= 0
    return MeshPart(
        name=faces.name,
        points=points[used],
        face_counts=np.array(faces.counts, np.int32),
        face_indices=indices.astype(np.int32),
        normals=normals[corners[:, 2]] if has_normals else None,
        face_material=np.array(faces.materials, np.int32),
        primvars={ST: np.where(mapped[:, None], st[corners[:, 1]], 0.0)} if mapped.any() else {},
    )


def _smoothed(parts: list[MeshPart], read: list[_ObjFaces]) -> tuple[MeshPart, ...]:
    """Return the parts, those without normals with some where their faces are smooth: at each point the mean of the
    normals of its smoothing group's faces, weighted by their angles there, as Blender has it."""
    if not any(any(each.smoothing) for each in read):
        return tuple(parts)
    ways, flat, keys = [], [], []
    groups = 1 + max(max(each.smoothing) for each in read)
    for part, faces in zip(parts, read, strict=True):
        corners, starts = part.points[part.face_indices], part.face_starts
        before, after = np.arange(-1, len(corners) - 1), np.arange(1, len(corners) + 1)
        before[starts], after[starts + part.face_counts - 1] = starts + part.face_counts - 1, starts
        edges = unit_vectors(corners[before] - corners), unit_vectors(corners[after] - corners)
        flat.append(np.repeat(unit_vectors(part.areas[0]), part.face_counts, axis=0))
        ways.append(flat[-1] * np.arccos(np.clip((edges[0] * edges[1]).sum(1), -1, 1))[:, None])
        points = np.array(faces.corners, np.int64)[:, 0]
        keys.append(points * groups + np.repeat(faces.smoothing, part.face_counts))
    _, place = np.unique(np.concatenate(keys), return_inverse=True)
    sums = np.stack([np.bincount(place, column) for column in np.concatenate(ways).T], axis=1)[place]
    means = np.split(sums, np.cumsum([len(each) for each in keys])[:-1])
    return tuple(
        part
        if part.normals is not None or not any(faces.smoothing)
        else replace(part, normals=np.where((own % groups > 0)[:, None], mean, plain))
        for part, faces, own, mean, plain in zip(parts, read, keys, means, flat, strict=True)
    )


def _plain_where_unmapped(asset: MeshAsset, faces: list[_ObjFaces]) -> MeshAsset:
    """Faces that lack texture coordinates get their material's constants alone, with a note."""
    materials = list(asset.materials)
    parts, notes = [], []
    for part, read in zip(asset.parts, faces, strict=True):
        unmapped = np.logical_or.reduceat(np.array([st < 0 for _, st, _ in read.corners]), part.face_starts)
        textured = np.array([*(bool(material.images) for material in asset.materials), False])
        plain = unmapped & textured[part.face_material]  # -1, no material, is the last
        face_material = part.face_material.copy()
        for index in np.unique(face_material[plain]):
            bare = ModelMaterial(constants=asset.materials[index].constants)
            if bare not in materials:
                materials.append(bare)
            face_material[plain & (part.face_material == index)] = materials.index(bare)
        if plain.any():
            found = f"{plain.sum()} faces of part {part.name!r} have no texture coordinates"
            notes.append(f"{found}: they show their material's constants without its textures")
        parts.append(replace(part, face_material=face_material))
    return replace(asset, parts=tuple(parts), materials=tuple(materials), notes=(*asset.notes, *notes))


def read_materials(
    path: Path, names: list[str], libraries: list[str]
) -> tuple[tuple[ModelMaterial, ...], tuple[str, ...]]:
    """Read a material for each of `names`, and notes. `libraries` are the arguments of the mtllib statements of `path`.

    Raises InputError that names a library and the line in it.
    """
    materials: dict[str, ModelMaterial] = {}
    notes: list[str] = []
    for library in (name for argument in libraries for name in _names(path.parent, argument)):
        file = file_within(root_of(path), path.parent, library)
        if file is None:
            lies = "lies outside the model's folder and was not read (--root FOLDER takes it)"
            notes.append(f"the material library {library!r} {lies}")
        elif not file.is_file():
            notes.append(f"the material library {library!r} is missing")
        else:
            found, remarks = read_mtl(file, lines_of(file, MAX_TABLE), root_of(path))
            materials |= found
            notes += remarks
    usual = path.with_suffix(".mtl")
    if not materials and names and usual.is_file():
        materials, remarks = read_mtl(usual, lines_of(usual, MAX_TABLE), root_of(path))
        notes += [f"materials are taken from {usual.name}, which the file does not name", *remarks]
    missing = [name for name in names if name not in materials]
    if missing:
        notes.append(f"{len(missing)} of {len(names)} materials have no definition and are neutral grey")
    grey = {name: ModelMaterial(constants=Material(path=name)) for name in missing}
    return tuple((materials | grey)[name] for name in names), tuple(notes)


def _names(folder: Path, argument: str) -> list[str]:
    """Return the libraries that one mtllib names: one, which may have blanks in its name, or several where they are
    there; a backslash before a blank makes it a part of the name."""
    words = [word.replace("\\ ", " ") for word in re.split(r"(?<!\\)\s+", argument)]
    return words if not _is_there(folder, argument) and any(_is_there(folder, word) for word in words) else [argument]


def _is_there(folder: Path, named: str) -> bool:
    file = file_within(folder, folder, named)
    return file is not None and file.is_file()

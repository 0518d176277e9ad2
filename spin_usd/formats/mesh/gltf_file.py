"""glTF and GLB, as stored: a part for each primitive of each mesh that a node of the scene places.

Nothing is merged, smoothed or computed. Source: glTF 2.0, sections 3.5 and 3.7.
"""

import re
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import decoding
from spin_usd.basics.unique_names import UniqueNames
from spin_usd.errors import GeometryError, InputError
from spin_usd.formats.mesh.gltf_document import Document, read_document
from spin_usd.formats.mesh.gltf_json import JsonObject
from spin_usd.formats.mesh.gltf_materials import (
    DISPLAY_COLOR,
    MATERIAL_EXTENSIONS,
    OPAQUE,
    base_color,
    has_base_texture,
    primvar,
    read_material,
)
from spin_usd.formats.mesh.gltf_meshopt import MESHOPT
from spin_usd.formats.mesh.gltf_placement import (
    INSTANCING,
    LEVELS,
    VISIBILITY,
    PlacedMesh,
    Values,
    copies_of,
    placed_meshes,
)
from spin_usd.geometry.triangles import strip_triangles
from spin_usd.scene.asset import AT_REST, MAX_PARTS, MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.material import Material
from spin_usd.scene.shape import MAX_FACES, MIN_SHARED_FACES
from spin_usd.scene.texture import Primvar

TRIANGLES, STRIP, FAN = 4, 5, 6
COORDINATES, COLOR = re.compile(r"TEXCOORD_(0|[1-9]\d{0,3})"), "COLOR_0"
UNNAMED = re.compile(r"NAUO\d+|=>\[[\d:]+\]|")  # names by Open CASCADE of the use of a product, and of a shape in it
MANY_FACES = 1_000_000
SHARED = f"to share a mesh, place it by {INSTANCING}, not sheared or mirrored, with {MIN_SHARED_FACES} faces or more"
DRACO = "KHR_draco_mesh_compression"


HANDLED = {*MATERIAL_EXTENSIONS, DRACO, MESHOPT, INSTANCING, LEVELS, VISIBILITY, "KHR_mesh_quantization"}
MOVING = ("CESIUM_RTC",)
MOVES_NOTHING = re.compile("[A-Z]+_(materials?|textures?|lights?|audio|xmp|metadata|structural|animation)_")


@dataclass
class _Model:
    """The part of the model read so far."""

    document: Document
    parts: list[MeshPart] = field(default_factory=list)
    materials: dict[tuple[int, frozenset[int], bool], tuple[int, ModelMaterial]] = field(default_factory=dict)
    """By (index, texture coordinates, colours) of the parts that have them."""
    notes: dict[str, None] = field(default_factory=dict)
    faces: int = 0
    once: dict[str, int] = field(default_factory=dict)
    """Faces by the primitives that have them."""


def read_gltf(path: Path) -> MeshAsset:
    """Read the model, metres. Raises InputError that names the file, GeometryError."""
    document = read_document(path)
    _refuse_unread(document)
    model = _Model(document)
    _read_parts(model)
    if not model.parts:
        raise InputError("holds no faces", where=path, do="; ".join(model.notes) or None)
    unknown = sorted(set(document.json.texts("extensionsUsed")) - HANDLED)
    notes = [f"glTF extensions that are not carried over: {', '.join(unknown)}"] if unknown else []
    if LEVELS in document.json.texts("extensionsUsed"):
        notes.append(f"its coarser levels of detail ({LEVELS}) are left out")
    extensions = document.json.object("extensions").object("KHR_materials_variants")
    if variants := [each.text("name", "") for each in extensions.objects("variants", MAX_PARTS)]:
        notes.append(f"its variants of materials, {', '.join(variants)}, are left out: it has its default materials")
    if "animations" in document.json:
        notes.append(AT_REST)
    faces, once = sum(len(part.face_counts) for part in model.parts), sum(model.once.values())
    if faces > MANY_FACES and faces >= 2 * once:
        notes.append(f"copies by its nodes make {faces} faces of {once}, which take time and memory: {SHARED}")
    materials = tuple(material for _, material in model.materials.values())
    return MeshAsset(
        name=path.stem, parts=tuple(model.parts), materials=materials, notes=(*model.notes, *notes), up="y"
    )


def _refuse_unread(document: Document) -> None:
    """Refuse extensions that are not read and move geometry, or are required and might move it: without them the model
    would be another."""
    used = set(document.json.texts("extensionsUsed")) & set(MOVING)
    required = {name for name in document.json.texts("extensionsRequired") if not MOVES_NOTHING.match(name)}
    unknown = sorted((used | required) - HANDLED)
    if unknown:
        do = "export the model without it"
        raise InputError(f"needs the glTF extension {', '.join(unknown)}", where=document.path, do=do)


def _read_parts(model: _Model) -> None:
    places: dict[int, list[PlacedMesh]] = {}
    placed = list(placed_meshes(model.document))
    around_all = set(placed[0].groups).intersection(*(place.groups for place in placed)) if placed else set()
    for place in placed:
        places.setdefault(place.mesh, []).append(place)
    meshes = {index: model.document.entry("meshes", index) for index in sorted(places)}
    primitives = {index: model.document.primitives(mesh) for index, mesh in meshes.items()}
    parts = sum(len(places[index]) * sum(map(_has_faces, each)) for index, each in primitives.items())
    if parts > MAX_PARTS:
        raise GeometryError(f"the model has {parts} parts, more than {MAX_PARTS}; join some")
    names = UniqueNames(first=1, cased=True)
    for index, mesh in meshes.items():
        if "weights" in mesh or any("targets" in primitive for primitive in primitives[index]):
            model.notes["its morph targets are not applied"] = None
        for place in places[index]:
            found = (place.name, mesh.text("name", ""), *reversed(place.groups))
            name = next((each for each in found if not UNNAMED.fullmatch(each)), model.document.path.stem)
            groups = (each for each in place.groups if each not in around_all and not UNNAMED.fullmatch(each))
            below = replace(place, groups=(*groups, name))
            for primitive in primitives[index]:
                _read_primitive(model, primitive, below, names.give(name))


def _has_faces(primitive: JsonObject) -> bool:
    return primitive.whole("mode", TRIANGLES) in (TRIANGLES, STRIP, FAN)


def _read_primitive(model: _Model, primitive: JsonObject, place: PlacedMesh, name: str) -> None:
    if not _has_faces(primitive):
        model.notes[f"{name!r} is made of points or lines, which are skipped"] = None
        return
    if _is_empty(model.document, primitive):
        model.notes[f"{name!r} has no faces and is skipped"] = None
        return
    decoded = decompressed(model.document, primitive)
    values, attributes = partial(model.document.values, decoded=decoded or {}), primitive.wholes_by_name("attributes")
    points = values(attributes["POSITION"], (3,)).astype(np.float64)
    faces, rest = _faces(values, primitive, len(points), TRIANGLES if decoded else primitive.whole("mode", TRIANGLES))
    if rest:
        model.notes[f"{name!r} ends with {rest} corners that make no triangle, which are skipped"] = None
    if not len(faces):
        return
    corners = faces.ravel()
    if corners.max() >= len(points):
        raise GeometryError(f"part {name!r} has a face with point {corners.max()}, expected 0 to {len(points) - 1}")

    def of_points(key: str, *widths: int) -> Float:
        found = values(attributes[key], widths)
        if len(found) != len(points):
            raise GeometryError(f"part {name!r} has {len(points)} points and {len(found)} values of {key}")
        return found.astype(np.float64)

    normals = of_points("NORMAL", 3) if "NORMAL" in attributes else None
    sets = sorted(int(found[1]) for key in attributes if (found := COORDINATES.fullmatch(key)))
    primvars = {primvar(i): of_points(f"TEXCOORD_{i}", 2) * (1, -1) + (0, 1) for i in sets}
    colors = of_points(COLOR, 3, 4) if COLOR in attributes else None
    material, colors = _material(model, primitive, frozenset(sets), name, colors)
    if colors is not None:
        primvars[DISPLAY_COLOR] = colors
    transforms = place.transforms(attributes, values)
    model.faces += len(transforms) * len(faces)
    model.once[primitive.place] = len(faces)
    if model.faces > MAX_FACES:
        raise GeometryError(f"the model has {model.faces} faces and more, expected at most {MAX_FACES}")
    if any(each.ndim == 3 and len(each) != len(points) for each in transforms):
        raise GeometryError(f"part {name!r} has {len(points)} points and joints for {len(transforms[0])}")
    alike = len(transforms) > 1 and not place.skinned and len(faces) >= MIN_SHARED_FACES
    if (copies := copies_of(place.matrices) if alike else None) is not None:
        model.notes[f"the {len(copies)} copies of {name!r} share its {len(faces)} faces"] = None
        transforms = transforms[:1]
    moved = [_moved(matrix, points, normals, faces) for matrix in transforms]
    found_normals = [each for _, each, _ in moved if each is not None]
    order = np.concatenate([each for _, _, each in moved])
    corners = np.concatenate([each + n * len(points) for n, (_, _, each) in enumerate(moved)])
    model.parts.append(
        MeshPart(
            name=name,
            groups=tuple(group for group in place.groups if group != name),
            points=np.concatenate([each for each, _, _ in moved]),
            face_counts=np.full(len(corners) // 3, 3, np.int32),
            face_indices=corners.astype(np.int32),
            normals=np.concatenate(found_normals)[corners] if len(found_normals) == len(moved) else None,
            face_material=np.full(len(corners) // 3, material, np.int32),
            primvars={key: found[order] for key, found in primvars.items()},
            copies=copies,
        )
    )


def _moved(
    to_body: Float, points: Float, normals: Float | None, faces: NDArray[np.int64]
) -> tuple[Float, Float | None, NDArray[np.int64]]:
    """Return points (P, 3), normals (P, 3) and the faces' corners where `to_body` puts them, a matrix (4, 4), or one
    (P, 4, 4) for each point; without normals where it flattens."""
    linear = to_body[..., :3, :3]
    volume = np.linalg.det(linear)
    if np.sum(volume) < 0:
        faces = faces[:, ::-1]  # a mirrored face is seen from its other side
    if normals is not None:
        normals = _times(normals, np.linalg.inv(linear)) if np.all(volume) else None
    return _times(points, linear.swapaxes(-1, -2)) + to_body[..., :3, 3], normals, faces.ravel()


def _times(rows: Float, matrix: Float) -> Float:
    """Return the rows (P, 3) times a matrix (3, 3), or each times its own (P, 3, 3)."""
    return rows @ matrix if matrix.ndim == 2 else np.einsum("pi,pij->pj", rows, matrix)


def _is_empty(document: Document, primitive: JsonObject) -> bool:
    """Return whether it has no points or no indices: the standard forbids that, and exporters write it."""
    indices = [primitive.whole("indices")] if "indices" in primitive else []
    used = (primitive.object("attributes").whole("POSITION"), *indices)
    return any(document.entry("accessors", index).whole("count") == 0 for index in used)


def _faces(values: Values, primitive: JsonObject, points: int, mode: int) -> tuple[NDArray[np.int64], int]:
    """Return (F, 3) of triangles, a strip or a fan, wound as in the standard, and the number of corners left over."""
    order = np.arange(points)
    if "indices" in primitive:
        order = values(primitive.whole("indices"), (1,), whole=True)[:, 0].astype(np.int64)
    if mode == TRIANGLES:
        rest = len(order) % 3
        return order[: len(order) - rest].reshape(-1, 3), rest
    if mode == FAN:
        return np.stack([order[1:-1], order[2:], np.full(max(len(order) - 2, 0), order[0])], axis=1), 0
    return strip_triangles(order), 0


def _material(
    model: _Model, primitive: JsonObject, sets: frozenset[int], name: str, colors: Float | None
) -> tuple[int, Float | None]:
    """Return (index into the materials or -1, displayColor of the points or None): COLOR_0 multiplies the base
    colour."""
    index = primitive.whole("material") if "material" in primitive else -1
    entry = model.document.entry("materials", index) if index >= 0 else primitive.object("material")
    if colors is not None:
        colors = _colors(model, entry, colors, name)
    if index < 0 and colors is None:
        return -1, None
    key = (index, sets, colors is not None)
    if key not in model.materials:
        found = ModelMaterial(constants=Material(path="vertex_colors", diffuse_color=Primvar(name=DISPLAY_COLOR)))
        if index >= 0:
            found, notes = read_material(model.document, index, sets=sets, colored=colors is not None)
            model.notes |= dict.fromkeys(notes)
        model.materials[key] = len(model.materials), found
    return model.materials[key][0], colors


def _colors(model: _Model, entry: JsonObject, colors: Float, name: str) -> Float | None:
    """Return the base colour as the colours change it; None, with a note where it matters, where they cannot be
    shown."""
    if colors.shape[1] == 4 and entry.text("alphaMode", OPAQUE) != OPAQUE and (colors[:, 3] < 1).any():
        model.notes[f"the opacity in the vertex colours of {name!r} is not carried over"] = None
    if (colors[:, :3] == 1).all():
        return None
    if has_base_texture(entry):
        found = f"the vertex colours of {name!r} are not carried over: UsdPreviewSurface cannot multiply them"
        model.notes[f"{found} by a texture"] = None
        return None
    return np.asarray(colors[:, :3] * np.array(base_color(entry)[:3]))


def decompressed(document: Document, primitive: JsonObject) -> dict[int, NDArray[Any]] | None:
    """Return replacements of the primitive's accessors by their indices, as triangles; None if not compressed.

    KHR_draco_mesh_compression has a primitive's numbers in one compressed buffer view, which Google's own decoder
    reads. Attributes are found by their unique ids; the accessors' own buffers, if present, are a fallback for readers
    without a decoder. Strips become triangles. Source: the extension's text. Raises InputError.
    """
    if DRACO not in primitive.object("extensions"):
        return None
    said = primitive.object("extensions").object(DRACO)
    data = bytes(document.view(said.whole("bufferView")))
    with decoding(f"{document.path}, {said.place}"):
        mesh = DracoPy.decode(data)
        by_id = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
        faces = np.asarray(mesh.faces).reshape(-1, 1)
    attributes, found = primitive.wholes_by_name("attributes"), {primitive.whole("indices"): faces}
    for name, number in said.wholes_by_name("attributes").items():
        if name not in attributes or number not in by_id:
            raise said.damaged(f"{said.place} has no {name} that the primitive has too")
        found[attributes[name]] = by_id[number]
    return found

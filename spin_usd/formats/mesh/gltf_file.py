"""glTF and GLB, as the file says it: a part for each primitive of each mesh where a node of the scene places it.

Nothing is merged, smoothed or computed. Source: glTF 2.0, sections 3.5 and 3.7.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.errors import GeometryError, InputError
from spin_usd.formats.mesh.gltf_document import Document, at, read_document
from spin_usd.formats.mesh.gltf_draco import DRACO, decompressed
from spin_usd.formats.mesh.gltf_materials import (
    DISPLAY_COLOR,
    MATERIAL_EXTENSIONS,
    OPAQUE,
    base_color,
    has_base_texture,
    primvar,
    read_material,
)
from spin_usd.formats.mesh.triangle_strips import strip_triangles
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.scene.material import Material
from spin_usd.scene.source.asset import MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.texture import Primvar

TRIANGLES, STRIP, FAN = 4, 5, 6
COORDINATES, COLOR = "TEXCOORD_", "COLOR_0"
HANDLED = {*MATERIAL_EXTENSIONS, DRACO, "KHR_mesh_quantization"}

Values = Callable[[int], NDArray[Any]]
"""The numbers of an accessor, by its index."""


@dataclass
class _Model:
    """The part of the model that is read so far; materials by (index, texture coordinates, colours) of the parts that
    have them."""

    document: Document
    parts: list[MeshPart] = field(default_factory=list)
    materials: dict[tuple[int, frozenset[int], bool], tuple[int, ModelMaterial]] = field(default_factory=dict)
    notes: dict[str, None] = field(default_factory=dict)


def read_gltf(path: Path) -> MeshAsset:
    """Read the model, metres. Raises InputError that names the file."""
    try:
        document = read_document(path)
        _refuse_required(document)
        model = _Model(document)
        _read_parts(model)
    except (InputError, GeometryError):
        raise
    except OSError as error:
        about = f" {Path(error.filename).name!r}" if error.filename else ""
        raise InputError(f"cannot be read ({error.strerror or error}{about})", where=path) from None
    # A damaged file can lead any look-up and any sum astray.
    except Exception as error:
        raise InputError(f"cannot be read as {path.suffix[1:].upper()} ({error!r})", where=path) from None
    if not model.parts:
        raise InputError("holds no faces", where=path, do="; ".join(model.notes) or None)
    unknown = sorted(set(document.json.get("extensionsUsed", [])) - HANDLED)
    notes = [f"glTF extensions that are not carried over: {', '.join(unknown)}"] if unknown else []
    materials = tuple(material for _, material in model.materials.values())
    return MeshAsset(name=path.stem, parts=tuple(model.parts), materials=materials, notes=(*model.notes, *notes))


def _refuse_required(document: Document) -> None:
    """Refuse what requires an extension that this reader does not have: the standard forbids to load it."""
    unknown = sorted(set(document.json.get("extensionsRequired", [])) - HANDLED)
    if unknown:
        do = "export the model without it"
        raise InputError(f"requires the glTF extension {', '.join(unknown)}", where=document.path, do=do)


def _read_parts(model: _Model) -> None:
    places: dict[int, list[tuple[str, Float]]] = {}
    for node, to_body in _placed(model.document):
        places.setdefault(node["mesh"], []).append((str(node.get("name", "")), to_body))
        if "skin" in node:
            model.notes["its skins are not applied: the meshes are in their bind pose"] = None
    taken: set[str] = set()
    for index in sorted(places):
        mesh = at(model.document.entries("meshes"), index)
        if mesh.get("weights") or any("targets" in primitive for primitive in mesh["primitives"]):
            model.notes["its morph targets are not applied"] = None
        for node_name, to_body in places[index]:
            own = str(mesh.get("name") or node_name or model.document.path.stem)
            name = node_name if len(places[index]) > 1 and node_name else own
            for primitive in mesh["primitives"]:
                _read_primitive(model, primitive, to_body, _unique(name, taken))


def _unique(name: str, taken: set[str]) -> str:
    """`name`, numbered where it was met before."""
    found, number = name, 0
    while found in taken:
        number += 1
        found = f"{name}_{number}"
    taken.add(found)
    return found


def _placed(document: Document) -> Iterator[tuple[dict[str, Any], Float]]:
    """Yield (node, 4x4 to body axes) of the scene's nodes that have a mesh, in the scene's order."""
    nodes, scenes = document.entries("nodes"), document.entries("scenes")
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [i for i in range(len(nodes)) if i not in children]
    if scenes:
        roots = at(scenes, document.json.get("scene", 0)).get("nodes", [])
    seen: set[int] = set()
    stack = [(root, np.eye(4)) for root in reversed(roots)]
    while stack:
        index, parent = stack.pop()
        if index in seen:
            raise ValueError(f"node {index} has two parents")
        seen.add(index)
        node = at(nodes, index)
        to_body = parent @ _local(node)
        if "mesh" in node:
            yield node, to_body
        stack += [(child, to_body) for child in reversed(node.get("children", []))]


def _local(node: dict[str, Any]) -> Float:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T  # column after column
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64) / np.linalg.norm(node.get("rotation", 1))
    found = np.eye(4)
    found[:3, :3] = matrix_from_quaternion((w, x, y, z)) * np.array(node.get("scale", (1, 1, 1)))
    found[:3, 3] = node.get("translation", (0, 0, 0))
    return found


def _read_primitive(model: _Model, primitive: Mapping[str, Any], to_body: Float, name: str) -> None:
    if primitive.get("mode", TRIANGLES) not in (TRIANGLES, STRIP, FAN):
        model.notes[f"{name!r} is made of points or lines, which are skipped"] = None
        return
    if _is_empty(model.document, primitive):
        model.notes[f"{name!r} has no faces and is skipped"] = None
        return
    primitive, decoded = decompressed(model.document, primitive)
    values, attributes = partial(model.document.values, decoded=decoded), primitive["attributes"]
    points, linear = values(attributes["POSITION"]).astype(np.float64), to_body[:3, :3]
    faces, rest = _faces(values, primitive, len(points))
    if rest:
        model.notes[f"{name!r} ends with {rest} corners that make no triangle, which are skipped"] = None
    volume = np.linalg.det(linear)
    if volume < 0:
        faces = faces[:, ::-1]  # a mirrored face is seen from its other side
    if not len(faces):
        return
    corners = faces.ravel()
    if corners.max() >= len(points):
        raise GeometryError(f"part {name!r} has a face with point {corners.max()}, expected 0 to {len(points) - 1}")
    normals = values(attributes["NORMAL"]) @ np.linalg.inv(linear) if "NORMAL" in attributes and volume else None
    sets = [int(key[len(COORDINATES) :]) for key in attributes if key.startswith(COORDINATES)]
    primvars = {primvar(i): values(attributes[f"{COORDINATES}{i}"]) * (1, -1) + (0, 1) for i in sorted(sets)}
    material, colors = _material(model, primitive, frozenset(sets), name, values)
    if colors is not None:
        primvars[DISPLAY_COLOR] = colors
    model.parts.append(
        MeshPart(
            name=name,
            points=points @ linear.T + to_body[:3, 3],
            face_counts=np.full(len(faces), 3, np.int32),
            face_indices=corners.astype(np.int32),
            normals=None if normals is None else normals[corners],
            face_material=np.full(len(faces), material, np.int32),
            primvars={key: found[corners] for key, found in primvars.items()},
        )
    )


def _is_empty(document: Document, primitive: Mapping[str, Any]) -> bool:
    """Return whether it has no points or no indices: the standard forbids that, and exporters write it."""
    indices = [primitive["indices"]] if "indices" in primitive else []
    used = [at(document.entries("accessors"), index) for index in (primitive["attributes"]["POSITION"], *indices)]
    return any(accessor["count"] == 0 for accessor in used)


def _faces(values: Values, primitive: Mapping[str, Any], points: int) -> tuple[NDArray[np.int64], int]:
    """Return (F, 3) of triangles, a strip or a fan, all wound as the standard says; and how many corners are left
    over."""
    order = np.arange(points)
    if "indices" in primitive:
        order = values(primitive["indices"])[:, 0].astype(np.int64)
    mode = primitive.get("mode", TRIANGLES)
    if mode == TRIANGLES:
        rest = len(order) % 3
        return order[: len(order) - rest].reshape(-1, 3), rest
    if mode == FAN:
        return np.stack([order[1:-1], order[2:], np.full(max(len(order) - 2, 0), order[0])], axis=1), 0
    return strip_triangles(order), 0


def _material(
    model: _Model, primitive: Mapping[str, Any], sets: frozenset[int], name: str, values: Values
) -> tuple[int, Float | None]:
    """Return (index into the materials or -1, displayColor of the points or None): COLOR_0 multiplies the base
    colour."""
    index = int(primitive.get("material", -1))
    entry = at(model.document.entries("materials"), index) if index >= 0 else {}
    colors = None
    if COLOR in primitive["attributes"]:
        colors = _colors(model, entry, values(primitive["attributes"][COLOR]), name)
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


def _colors(model: _Model, entry: dict[str, Any], colors: Float, name: str) -> Float | None:
    """Return the base colour as the colours change it; None, with a note where it matters, where they cannot be
    shown."""
    if colors.shape[1] == 4 and entry.get("alphaMode", OPAQUE) != OPAQUE and (colors[:, 3] < 1).any():
        model.notes[f"the opacity in the vertex colours of {name!r} is not carried over"] = None
    if (colors[:, :3] == 1).all():
        return None
    if has_base_texture(entry):
        found = f"the vertex colours of {name!r} are not carried over: UsdPreviewSurface cannot multiply them"
        model.notes[f"{found} by a texture"] = None
        return None
    return np.asarray(colors[:, :3] * np.array(base_color(entry)[:3]))

"""COLLADA (.dae), as stored: a part for each group of faces of each geometry that the scene places.

Nothing is merged or smoothed; the file's axes stay, whatever its up axis. A skin is shown in its bind pose, a morph
without its targets. Source: COLLADA 1.4.1, chapters 4 and 5.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.basics.nesting import MAX_DEPTH
from spin_usd.basics.unique_names import UniqueNames
from spin_usd.errors import GeometryError, InputError
from spin_usd.formats.mesh.dae_document import DaeDocument, inputs, metres_per_unit, read_dae_document, unit_notes
from spin_usd.formats.mesh.dae_materials import bindings, read_dae_material
from spin_usd.formats.mesh.vertex_colors import with_colors
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.geometry.triangles import strip_triangles
from spin_usd.scene.asset import MAX_PARTS, MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.shape import MAX_FACES

GROUPS = ("triangles", "polylist", "polygons", "tristrips", "trifans")
SKIPPED = ("lines", "linestrips")
MAX_NODES = 2**17  # of a scene, including its instances

Indices = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class _PlacedGeometry:
    """A geometry where a node called `name` places it; `instance` binds its materials."""

    geometry: Element
    instance: Element
    matrix: Float
    name: str


@dataclass
class _DaeModel:
    """The part of the model read so far."""

    document: DaeDocument
    parts: list[MeshPart] = field(default_factory=list)
    colors: list[Float | None] = field(default_factory=list)
    materials: dict[tuple[object, ...], tuple[int, ModelMaterial]] = field(default_factory=dict)
    notes: dict[str, None] = field(default_factory=dict)
    corners: dict[int, tuple[Indices, Indices]] = field(default_factory=dict)
    """By element, which a scene may place many times."""
    faces: int = 0


def read_dae(path: Path) -> MeshAsset:
    """Read the model in the file's own units, and how long they are. Raises InputError that names the file,
    GeometryError."""
    document = read_dae_document(path)
    model = _DaeModel(document)
    placed = list(_placed(model))
    groups = sum(len(_groups(each.geometry)) for each in placed)
    if groups > MAX_PARTS:
        raise GeometryError(f"the model has {groups} parts, more than {MAX_PARTS}; join some")
    often = {id(each.geometry): 0 for each in placed}
    for each in placed:
        often[id(each.geometry)] += 1
    names = UniqueNames(first=1, cased=True)
    for each in placed:
        own = each.geometry.get("name") or each.geometry.get("id") or path.stem
        name = each.name if often[id(each.geometry)] > 1 and each.name else own
        for group in _groups(each.geometry):
            _read_group(model, group, each, names.give(name))
    if not model.parts:
        raise InputError("holds no faces", where=path, do="; ".join(model.notes) or None)
    asset = MeshAsset(
        name=path.stem,
        parts=tuple(model.parts),
        materials=tuple(material for _, material in model.materials.values()),
        notes=(*model.notes, *unit_notes(document)),
        metres_per_unit=metres_per_unit(document) or 1.0,
        up=document.root.findtext("asset/up_axis", "Y_UP").strip()[:1].lower(),
    )
    return with_colors(asset, model.colors)


def _groups(geometry: Element) -> list[Element]:
    return [each for each in geometry.iterfind("mesh/*") if each.tag in GROUPS]


def _placed(model: _DaeModel) -> Iterator[_PlacedGeometry]:
    """Yield the geometries of the scene, in its order. Raises InputError."""
    document = model.document
    said = document.root.find("scene/instance_visual_scene")
    scene = document.root.find("library_visual_scenes/visual_scene") if said is None else None
    if said is not None:
        scene = document.named("visual_scene", said.get("url"))
    nodes = [] if scene is None else scene.findall("node")
    stack = [(node, np.eye(4), 1) for node in reversed(nodes)]
    count = 0
    while stack:
        node, parent, depth = stack.pop()
        count += 1
        if count > MAX_NODES or depth > MAX_DEPTH:
            raise document.damaged(node, "is one of too many, or instances itself")
        matrix = parent @ _matrix(document, node)
        below = []
        for child in node:
            if child.tag == "node":
                below.append(child)
            elif child.tag == "instance_node":
                below += _instanced(model, child, "node")
            elif child.tag == "instance_geometry":
                for geometry in _instanced(model, child, "geometry"):
                    yield _PlacedGeometry(geometry=geometry, instance=child, matrix=matrix, name=node.get("name", ""))
            elif child.tag == "instance_controller":
                for controller in _instanced(model, child, "controller"):
                    yield from _controlled(model, controller, child, matrix, node.get("name", ""))
        stack += [(child, matrix, depth + 1) for child in reversed(below)]


def _instanced(model: _DaeModel, element: Element, tag: str) -> list[Element]:
    """Return the element that an instance means, none with a note where the file does not have it."""
    found = model.document.named(tag, element.get("url"))
    if found is None:
        model.notes[f"its scene places {element.get('url', '')[:80]!r}, which is not in the file"] = None
    return [] if found is None else [found]


def _controlled(
    model: _DaeModel, controller: Element, instance: Element, matrix: Float, name: str
) -> Iterator[_PlacedGeometry]:
    """Yield the geometry of a skin, which its own node does not move, or of a morph."""
    document = model.document
    for _ in range(MAX_DEPTH):
        skin, morph = controller.find("skin"), controller.find("morph")
        source = None
        if skin is not None:
            model.notes["its skins are shown in the pose in which they were bound"] = None
            shape = skin.find("bind_shape_matrix")
            matrix = np.eye(4) if shape is None else document.numbers(shape, 16).reshape(4, 4)
            source = skin.get("source")
        elif morph is not None:
            model.notes["its morph targets are not applied"] = None
            source = morph.get("source")
        geometry, following = document.named("geometry", source), document.named("controller", source)
        if geometry is not None:
            yield _PlacedGeometry(geometry=geometry, instance=instance, matrix=matrix, name=name)
        if geometry is not None or following is None:
            return
        controller = following


def _matrix(document: DaeDocument, node: Element) -> Float:
    """Return (4, 4) of a node's transforms; the first is the outermost."""
    found = np.eye(4)
    for each in node:
        step = np.eye(4)
        if each.tag == "matrix":
            step = document.numbers(each, 16).reshape(4, 4)
        elif each.tag == "translate":
            step[:3, 3] = document.numbers(each, 3)
        elif each.tag == "scale":
            step[:3, :3] = np.diag(document.numbers(each, 3))
        elif each.tag == "rotate":
            step[:3, :3] = _rotation(*document.numbers(each, 4))
        elif each.tag in ("skew", "lookat"):
            step[:] = np.nan  # of cameras and lamps, which are not read; no exporter places a geometry by it
        found = found @ step
    return found


def _rotation(x: float, y: float, z: float, degrees: float) -> Float:
    """Return (3, 3) of a turn about an axis, which turns nothing where it has no length."""
    half, axis = np.radians(degrees) / 2, np.array([x, y, z])
    length = float(np.linalg.norm(axis))
    return matrix_from_quaternion([np.cos(half), *(np.sin(half) * axis / length)]) if length else np.eye(3)


def _read_group(model: _DaeModel, group: Element, placed: _PlacedGeometry, name: str) -> None:
    document = model.document
    if id(group) not in model.corners:
        model.corners[id(group)] = _corners(model, group, name)
    corners, counts = model.corners[id(group)]
    model.faces += len(counts)
    if model.faces > MAX_FACES:
        raise GeometryError(f"the model has {model.faces} faces and more, expected at most {MAX_FACES}")
    if not len(counts):
        model.notes[f"{name!r} has no faces and is skipped"] = None
        return
    found: dict[tuple[str, int], tuple[str | None, int]] = {}
    for semantic, url, offset, number in inputs(group):
        if semantic == "VERTEX":
            vertices = document.named("vertices", url)
            shared = [] if vertices is None else list(inputs(vertices))
            found = {(each, n): (source, offset) for each, source, _, n in shared} | found
        else:
            found[semantic, number] = url, offset

    def at_corners(semantic: str, width: int, number: int = 0) -> tuple[Float, Indices] | None:
        if (semantic, number) not in found:
            return None
        url, offset = found[semantic, number]
        values, indices = document.values(url, width), corners[:, offset]
        if indices.max() >= len(values):
            raise GeometryError(f"part {name!r} has {semantic} {indices.max()} of {len(values)}")
        return values, indices

    if not np.isfinite(placed.matrix).all():
        raise GeometryError(f"part {name!r} is placed by <skew>, <lookat> or no number; bake its transform")
    linear, order = placed.matrix[:3, :3], np.arange(len(corners))
    volume = np.linalg.det(linear)
    if volume < 0:  # a mirrored face is seen from its other side
        order = np.repeat(2 * (np.cumsum(counts) - counts) + counts - 1, counts) - order
    placed_points, normals, colors, primvars = at_corners("POSITION", 3), None, None, {}
    if placed_points is None:
        raise document.damaged(group, "has no positions")
    points, indices = placed_points
    used, indices = np.unique(indices[order], return_inverse=True)
    if volume and (own := at_corners("NORMAL", 3)):
        normals = own[0][own[1][order]] @ np.linalg.inv(linear)
    if own := at_corners("COLOR", 3):
        colors = own[0][own[1][order]]
    sets = sorted(number for semantic, number in found if semantic == "TEXCOORD")
    for number in sets:
        if own := at_corners("TEXCOORD", 2, number):
            primvars[_primvar(sets, number)] = own[0][own[1][order]]
    model.colors.append(colors)
    model.parts.append(
        MeshPart(
            name=name,
            groups=() if placed.name in ("", name) else (placed.name,),
            points=points[used] @ linear.T + placed.matrix[:3, 3],
            face_counts=counts.astype(np.int32),
            face_indices=indices.astype(np.int32),
            normals=normals,
            face_material=np.full(len(counts), _material(model, group, placed, sets), np.int32),
            primvars=primvars,
        )
    )


def _corners(model: _DaeModel, group: Element, name: str) -> tuple[Indices, Indices]:
    """Return (C, inputs) indices of the corners, face after face, and (F,) how many of them each face has."""
    document = model.document
    width = 1 + max((offset for _, _, offset, _ in inputs(group)), default=0)
    rows = []
    if group.find("ph") is not None:
        model.notes[f"the holes in polygons of {name!r} are filled"] = None
    for each in group.iter("p"):
        flat = document.indices(each)
        if len(flat) % width:
            raise document.damaged(each, f"holds {len(flat)} indices, expected a multiple of {width}")
        rows.append(flat.reshape(-1, width))
    if group.tag in ("tristrips", "trifans"):
        rows = [each[_strip(np.arange(len(each)), group.tag == "trifans").ravel()] for each in rows]
    corners = np.concatenate([np.zeros((0, width), np.int64), *rows])
    if group.tag == "polylist":
        counts = document.indices(group.find("vcount"))
    elif group.tag == "polygons":
        counts = np.array([len(each) for each in rows], np.int64)
    else:
        counts = np.full(len(corners) // 3, 3, np.int64)
    if counts.sum() != len(corners):
        raise document.damaged(group, f"has {len(corners)} corners, and its faces {counts.sum()}")
    keep = counts > 2
    return corners[np.repeat(keep, counts)], counts[keep]


def _strip(order: Indices, fan: bool) -> Indices:
    if fan:
        return np.stack([np.zeros(max(len(order) - 2, 0), np.int64), order[1:-1], order[2:]], axis=1)
    return np.asarray(strip_triangles(order), np.int64)


def _primvar(sets: list[int], number: int) -> str:
    place = sets.index(number)
    return f"st{place}" if place else "st"


def _material(model: _DaeModel, group: Element, placed: _PlacedGeometry, sets: list[int]) -> int:
    """Return the index of the group's material, -1 where it has none."""
    symbol = group.get("material")
    if symbol is None:
        return -1
    url, bound = bindings(placed.instance).get(symbol, (f"#{symbol}", {}))
    material = model.document.named("material", url)
    if material is None:
        model.notes[f"material {symbol!r} is not in the file"] = None
        return -1
    coordinates = {name: _primvar(sets, number) for name, number in bound.items() if number in sets}
    first = "st" if sets else None
    key = (id(material), tuple(sorted(coordinates.items())), first)
    if key not in model.materials:
        found, notes = read_dae_material(model.document, material, coordinates, first)
        model.notes |= dict.fromkeys(notes)
        model.materials[key] = len(model.materials), found
    return model.materials[key][0]

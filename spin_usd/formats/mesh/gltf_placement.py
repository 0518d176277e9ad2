"""Where a glTF scene places its meshes: by its nodes, by instances of one node, by the joints of a skin.

Source: glTF 2.0, sections 3.5 and 3.7.3, and the extensions EXT_mesh_gpu_instancing and KHR_node_visibility.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import GeometryError
from spin_usd.files.size_limits import MAX_PLACEMENTS
from spin_usd.formats.mesh.gltf_document import Document
from spin_usd.formats.mesh.gltf_json import JsonObject
from spin_usd.geometry.rotation import matrices_from_quaternions

MAX_GROUPS = 64  # kept of the nodes above one
SHEAR = 1e-6  # of a copy: float32 leaves less
INSTANCING, VISIBILITY, LEVELS = "EXT_mesh_gpu_instancing", "KHR_node_visibility", "MSFT_lod"


class Values(Protocol):
    """The numbers of an accessor, by its index, as from `Document.values`."""

    def __call__(self, index: int, widths: tuple[int, ...], *, whole: bool = False) -> NDArray[Any]: ...


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedMesh:
    """A mesh where the node `name` places it."""

    mesh: int
    name: str
    groups: tuple[str, ...]
    """Names of the nodes above."""
    matrices: Float
    """(N, 4, 4) to body axes, one for each instance; where `skinned`, one for each joint."""
    skinned: bool = False
    """Whether points follow the joints by their weights."""

    def transforms(self, attributes: Mapping[str, int], values: Values) -> list[Float]:
        """Return for each instance of a primitive with these attributes a matrix (4, 4), or matrices (P, 4, 4) of its
        points. Raises GeometryError for a skin whose points have no joints, or weights that are all zero."""
        if not self.skinned:
            return list(self.matrices)
        blended, total = np.zeros(()), np.zeros(())
        for number in range(sum(name.startswith("JOINTS_") for name in attributes)):
            names = f"JOINTS_{number}", f"WEIGHTS_{number}"
            if not set(names) <= set(attributes):
                raise GeometryError(f"a skin of {self.name!r} has no {' and '.join(names)}")
            joints, weights = values(attributes[names[0]], (4,), whole=True), values(attributes[names[1]], (4,))
            if joints.min() < 0 or joints.max() >= len(self.matrices):
                raise GeometryError(f"a point of {self.name!r} follows joint {joints.max()} of {len(self.matrices)}")
            if len(joints) != len(weights):
                raise GeometryError(
                    f"{self.name!r} has joints for {len(joints)} points, and weights for {len(weights)}"
                )
            for joint, weight in zip(joints.T, weights.T, strict=True):
                blended = blended + self.matrices[joint] * weight[:, None, None]
                total = total + weight
        if not np.all(total > 0):
            raise GeometryError(f"a point of {self.name!r} follows no joint of its skin")
        return [blended / total[:, None, None]]


@dataclass(frozen=True, kw_only=True, eq=False)
class _PlacedNode:
    """A node as those above it place it."""

    to_body: Float
    """(4, 4): from its axes to the body's."""
    visible: bool = True
    """True for a visible node."""
    groups: tuple[str, ...] = ()
    """Names of the nodes above it."""


def placed_meshes(document: Document) -> Iterator[PlacedMesh]:
    """Yield the meshes of the scene's visible nodes, in the scene's order. A skin's own node does not move it. Raises
    InputError."""
    found = dict(_placed_nodes(document))
    total = 0
    for index, placed in found.items():
        node = document.entry("nodes", index)
        if "mesh" not in node or not placed.visible:
            continue
        skinned = "skin" in node
        matrices = _joints(document, node, found) if skinned else placed.to_body @ _instances(document, node)
        if not np.isfinite(matrices).all():
            raise node.damaged(f"{node.place} is placed by a value that is not a number")
        total += len(matrices)
        if total > MAX_PLACEMENTS:
            raise node.damaged(f"has more than {MAX_PLACEMENTS} joints and instances in all")
        name = node.text("name", "")
        yield PlacedMesh(mesh=node.whole("mesh"), name=name, groups=placed.groups, matrices=matrices, skinned=skinned)


def _joints(document: Document, node: JsonObject, found: Mapping[int, _PlacedNode]) -> Float:
    """Return (J, 4, 4) from the points of the node's mesh to body axes, by each joint of its skin."""
    skin = document.entry("skins", node.whole("skin"))
    indices = skin.wholes("joints")
    if not indices or not set(indices) <= set(found):
        raise skin.damaged(f"{skin.place} has no joints, or joints that are not nodes of the scene")
    joints = np.stack([found[joint].to_body for joint in indices])
    if "inverseBindMatrices" not in skin:
        return joints
    inverse = document.values(skin.whole("inverseBindMatrices"), (16,))[: len(joints)]
    if len(inverse) != len(joints):
        raise skin.damaged(f"{skin.place} has {len(joints)} joints and {len(inverse)} inverseBindMatrices")
    return np.asarray(joints @ inverse.reshape(-1, 4, 4).swapaxes(1, 2))  # column after column


def _placed_nodes(document: Document) -> Iterator[tuple[int, _PlacedNode]]:
    """Yield the scene's nodes, in its order, by their index."""
    nodes = document.entries("nodes")
    children = {child for node in nodes for child in node.wholes("children")}
    roots = [i for i in range(len(nodes)) if i not in children]
    if document.entries("scenes"):
        roots = document.entry("scenes", document.json.whole("scene", 0)).wholes("nodes")
    levels = {level for node in nodes for level in node.object("extensions").object(LEVELS).wholes("ids")}  # coarser
    seen: set[int] = set()
    stack = [(root, _PlacedNode(to_body=np.eye(4))) for root in reversed(roots) if root not in levels]
    while stack:
        index, above = stack.pop()
        node = document.entry("nodes", index)
        if index in seen:
            raise node.damaged(f"{node.place} has two parents")
        seen.add(index)
        visible = above.visible and node.object("extensions").object(VISIBILITY).flag("visible", True)
        placed = replace(above, to_body=above.to_body @ _local(node), visible=visible)
        yield index, placed
        groups = (*above.groups, node.text("name", ""))[-MAX_GROUPS:]
        below = replace(placed, groups=tuple(filter(None, groups)))
        stack += [(child, below) for child in reversed(node.wholes("children")) if child not in levels]


def _local(node: JsonObject) -> Float:
    if "matrix" in node:
        matrix = np.array(node.numbers("matrix", tuple(np.eye(4).ravel())))
        return matrix.reshape(4, 4).T  # column after column
    if not any(name in node for name in ("translation", "rotation", "scale")):
        return np.eye(4)
    moved, turned = node.numbers("translation", (0, 0, 0)), node.numbers("rotation", (0, 0, 0, 1))
    scaled = node.numbers("scale", (1, 1, 1))
    return np.asarray(_matrices(np.array([moved]), np.array([turned]), np.array([scaled]))[0], np.float64)


def _instances(document: Document, node: JsonObject) -> Float:
    """Return (N, 4, 4) of the instances of a node, in its axes; one that moves nothing where it has none."""
    extensions = node.object("extensions")
    if INSTANCING not in extensions:
        return np.eye(4)[None]
    said = extensions.object(INSTANCING)
    attributes = said.wholes_by_name("attributes")
    widths = {"TRANSLATION": 3, "ROTATION": 4, "SCALE": 3}
    found = {name: document.values(attributes[name], (widths[name],)) for name in widths if name in attributes}
    if len({len(rows) for rows in found.values()}) > 1:
        raise said.damaged(f"the attributes of {said.place} are of different counts")
    return _matrices(*(found.get(name) for name in widths))


def _matrices(translation: Float | None, rotation: Float | None, scale: Float | None) -> Float:
    """Return (N, 4, 4) of translations (N, 3), quaternions x, y, z, w (N, 4) and scales (N, 3)."""
    counts = [len(each) for each in (translation, rotation, scale) if each is not None]
    found = np.tile(np.eye(4), (max(counts, default=1), 1, 1))
    if rotation is not None:
        with np.errstate(invalid="ignore"):  # a quaternion of zeros gives NaN, which is refused
            turned = rotation / np.linalg.norm(rotation, axis=1, keepdims=True)
        found[:, :3, :3] = matrices_from_quaternions(np.roll(turned, 1, axis=1))
    if scale is not None:
        found[:, :3, :3] *= scale[:, None, :]
    if translation is not None:
        found[:, :3, 3] = translation
    return found


def copies_of(matrices: Float) -> Float | None:
    """Return (N, 4, 4) that take what the first of `matrices` (N, 4, 4) places to where each does, by rotation, scale
    along its axes and translation; None where one shears, flattens or mirrors."""
    if not np.linalg.det(matrices[:, :3, :3]).all():
        return None
    moves = matrices @ np.linalg.inv(matrices[0])
    gram = np.einsum("nji,njk->nik", moves[:, :3, :3], moves[:, :3, :3])
    off = np.abs(gram * (1 - np.eye(3))).max((1, 2))
    plain = (off <= SHEAR * np.trace(gram, axis1=1, axis2=2)) & (np.linalg.det(moves[:, :3, :3]) > 0)
    return np.asarray(moves) if plain.all() else None

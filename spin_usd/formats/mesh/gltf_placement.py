"""Where a glTF scene places its meshes: by its nodes, by instances of one node, by the joints of a skin.

Source: glTF 2.0, sections 3.5 and 3.7.3, and the extensions EXT_mesh_gpu_instancing and KHR_node_visibility.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.formats.mesh.gltf_document import Document, at
from spin_usd.geometry.rotation import matrices_from_quaternions

INSTANCING, VISIBILITY = "EXT_mesh_gpu_instancing", "KHR_node_visibility"

Values = Callable[[int], NDArray[Any]]
"""The numbers of an accessor, by its index."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedMesh:
    """A mesh where the node `name` places it: `matrices` (N, 4, 4) to body axes, one for each instance, or where
    `skinned` one for each joint, which points follow by their weights."""

    mesh: int
    name: str
    matrices: Float
    skinned: bool = False

    def transforms(self, attributes: Mapping[str, int], values: Values) -> list[Float]:
        """Return for each instance of a primitive with these attributes a matrix (4, 4), or matrices (P, 4, 4) of its
        points. Raises ValueError for a skin whose points have no joints, or weights that are all zero."""
        if not self.skinned:
            return list(self.matrices)
        blended, total = np.zeros(()), np.zeros(())
        for number in range(sum(name.startswith("JOINTS_") for name in attributes)):
            joints, weights = values(attributes[f"JOINTS_{number}"]), values(attributes[f"WEIGHTS_{number}"])
            if joints.max() >= len(self.matrices):
                raise ValueError(f"a point follows joint {joints.max()} of {len(self.matrices)}")
            for joint, weight in zip(joints.T, weights.T, strict=True):
                blended = blended + self.matrices[joint] * weight[:, None, None]
                total = total + weight
        if not np.all(total > 0):
            raise ValueError("a point of a skin follows no joint")
        return [blended / total[:, None, None]]


def placed_meshes(document: Document) -> Iterator[PlacedMesh]:
    """Yield the meshes of the scene's visible nodes, in the scene's order. A skin's own node does not move it."""
    nodes = document.entries("nodes")
    found = dict(_to_body(document))
    for index, (to_body, visible) in found.items():
        node = nodes[index]
        if "mesh" not in node or not visible:
            continue
        name, mesh = str(node.get("name", "")), int(node["mesh"])
        if "skin" in node:
            skin = at(document.entries("skins"), node["skin"])
            joints = np.stack([found[joint][0] for joint in skin["joints"]])
            if "inverseBindMatrices" in skin:  # column after column
                inverse = document.values(skin["inverseBindMatrices"])[: len(joints)]
                joints = joints @ inverse.reshape(-1, 4, 4).swapaxes(1, 2)
            yield PlacedMesh(mesh=mesh, name=name, matrices=joints, skinned=True)
            continue
        instancing = node.get("extensions", {}).get(INSTANCING)
        instances = np.eye(4)[None] if instancing is None else _instances(document, instancing["attributes"])
        yield PlacedMesh(mesh=mesh, name=name, matrices=to_body @ instances)


def _to_body(document: Document) -> Iterator[tuple[int, tuple[Float, bool]]]:
    """Yield (node, (4x4 to body axes, whether it is visible)) of the scene's nodes, in its order."""
    nodes, scenes = document.entries("nodes"), document.entries("scenes")
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [i for i in range(len(nodes)) if i not in children]
    if scenes:
        roots = at(scenes, document.json.get("scene", 0)).get("nodes", [])
    seen: set[int] = set()
    stack = [(root, np.eye(4), True) for root in reversed(roots)]
    while stack:
        index, parent, visible = stack.pop()
        if index in seen:
            raise ValueError(f"node {index} has two parents")
        seen.add(index)
        node = at(nodes, index)
        to_body = parent @ _local(node)
        visible = visible and node.get("extensions", {}).get(VISIBILITY, {}).get("visible", True)
        yield index, (to_body, visible)
        stack += [(child, to_body, visible) for child in reversed(node.get("children", []))]


def _local(node: dict[str, Any]) -> Float:
    if "matrix" in node:
        matrix: Float = np.array(node["matrix"], np.float64).reshape(4, 4).T  # column after column
        return matrix
    rows = {name: np.array([node[name]], np.float64) for name in ("translation", "rotation", "scale") if name in node}
    return np.asarray(_matrices(rows.get("translation"), rows.get("rotation"), rows.get("scale"))[0], np.float64)


def _instances(document: Document, attributes: Mapping[str, int]) -> Float:
    """Return (N, 4, 4) of the instances of a node, in its axes."""
    names = ("TRANSLATION", "ROTATION", "SCALE")
    return _matrices(*(document.values(attributes[name]) if name in attributes else None for name in names))


def _matrices(translation: Float | None, rotation: Float | None, scale: Float | None) -> Float:
    """Return (N, 4, 4) of translations (N, 3), quaternions x, y, z, w (N, 4) and scales (N, 3)."""
    counts = [len(each) for each in (translation, rotation, scale) if each is not None]
    found = np.tile(np.eye(4), (max(counts, default=1), 1, 1))
    if rotation is not None:
        turned = rotation / np.linalg.norm(rotation, axis=1, keepdims=True)
        found[:, :3, :3] = matrices_from_quaternions(np.roll(turned, 1, axis=1))
    if scale is not None:
        found[:, :3, :3] *= scale[:, None, :]
    if translation is not None:
        found[:, :3, 3] = translation
    return found

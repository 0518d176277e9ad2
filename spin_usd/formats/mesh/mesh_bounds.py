"""The box of a mesh file's faces, read by trimesh: an authority apart from our own readers."""

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.mesh.gltf_document import Document, read_document
from spin_usd.formats.mesh.gltf_meshopt import MESHOPT
from spin_usd.formats.mesh.gltf_placement import INSTANCING, LEVELS, VISIBILITY
from spin_usd.geometry.triangles import areas, parts
from spin_usd.scene.source_bounds import SourceBounds

if TYPE_CHECKING:
    import trimesh

STEP, STEP_ERROR = (".step", ".stp"), 0.02  # by its default, half a radian between the faces of a circle
GLTF, DAE = (".gltf", ".glb"), ".dae"
BEYOND_TRIMESH = (INSTANCING, LEVELS, VISIBILITY, MESHOPT)


def mesh_bounds(path: Path, units_per_metre: float | None) -> SourceBounds | None:
    """Return the model's size in metres; None where trimesh cannot read it, or finds no face with an area. It reads
    COLLADA where pycollada happens to be installed, and without its unit."""
    if path.suffix.lower() == DAE:
        return None
    try:
        beside = _buffers_beside(path)
        if beside is None:
            return None
        with decoding(path):
            scene = _loaded(path, beside)
            corners = [_corners(scene, node) for node in scene.graph.nodes_geometry]
    except InputError:
        return None
    points = np.concatenate([np.zeros((0, 3)), *corners]) / (units_per_metre or 1.0)
    if not len(points) or not np.isfinite(points).all():
        return None
    box = np.stack([points.min(0), points.max(0)])
    error = {"error": STEP_ERROR} if path.suffix.lower() in STEP else {}
    return SourceBounds(whole=box, polygons=box, exact=True, **error)


def _buffers_beside(path: Path) -> dict[str, bytes] | None:
    """Return the buffers that a glTF file names, by their names; None if trimesh misreads the file."""
    if path.suffix.lower() not in GLTF:
        return {}
    document = read_document(path)
    return None if _is_beyond_trimesh(document) else document.buffers_beside()


def _is_beyond_trimesh(document: Document) -> bool:
    """Return whether trimesh 5.2 misreads the size: it ignores sparse values, skins, instances, hidden nodes and
    meshopt's compression, and does not normalise integer positions."""
    primitives = [primitive for mesh in document.entries("meshes") for primitive in document.primitives(mesh)]
    points = [document.entry("accessors", primitive.object("attributes").whole("POSITION")) for primitive in primitives]
    odd = any(accessor.flag("normalized", False) or "sparse" in accessor for accessor in points)
    used = {*document.json.texts("extensionsUsed"), *document.json.texts("extensionsRequired")}
    return odd or any("skin" in node for node in document.entries("nodes")) or not used.isdisjoint(BEYOND_TRIMESH)


def _loaded(path: Path, beside: dict[str, bytes]) -> "trimesh.Scene":
    """Return the file's geometry alone: nothing that it names is read, but for its buffers, which lie `beside`."""
    import trimesh  # not above: trimesh is slow to load, and few models need it

    kind = path.suffix.lower().removeprefix(".")
    file = io.BytesIO(read_bytes(path, MAX_MODEL))  # trimesh takes an open file's name for its parts'
    return trimesh.load_scene(file, file_type=kind, resolver=beside, process=False, skip_materials=True)


def _corners(scene: "trimesh.Scene", node: str) -> Float:
    """Return (N, 3) corners of boxes around the triangles with an area that `node` places, in the file's axes."""
    import trimesh  # not above: trimesh is slow to load, and few models need it

    transform, name = scene.graph[node]
    mesh = scene.geometry[name]
    if not isinstance(mesh, trimesh.Trimesh):
        return np.zeros((0, 3))
    points, boxes = np.asarray(trimesh.transform_points(mesh.vertices, transform)), [np.zeros((0, 3))]
    for some in parts(len(mesh.faces)):
        triangles = points[mesh.faces[some]]
        seen = triangles[areas(triangles) > 0].reshape(-1, 3)
        boxes += [seen.min(0)[None], seen.max(0)[None]] if len(seen) else []
    return np.concatenate(boxes)

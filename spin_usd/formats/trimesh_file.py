"""PLY, STL, glTF and GLB, parsed by trimesh: the file's points, faces and normals, with glTF's node transforms applied.

A mesh, or a primitive of one, is a part. Nothing is merged, smoothed or computed.
"""

from pathlib import Path

import numpy as np
import trimesh

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.formats.gltf_materials import read_gltf_materials
from spin_usd.scene.asset import MeshAsset, MeshPart
from spin_usd.scene.material import Material

GLTF = {".gltf", ".glb"}


def read_with_trimesh(path: Path) -> MeshAsset:
    """The model in the file's own units. Raises InputError that names the file."""
    scene = _trimesh_scene(path)
    exact, textured = read_gltf_materials(path) if path.suffix.lower() in GLTF else ({}, False)
    materials: list[Material] = []
    parts = []
    for name, mesh, to_body in _placed_meshes(scene, path):
        material = _material(mesh, exact)
        index = -1 if material is None else _index(materials, material)
        parts.append(_part(name, mesh, to_body, index))
    notes = ("textures are not carried over: the materials keep their constant factors",) if textured else ()
    if not parts:
        raise InputError("holds no faces", where=path)
    return MeshAsset(name=path.stem, parts=tuple(parts), materials=tuple(materials), notes=notes)


def _trimesh_scene(path: Path) -> trimesh.Scene:
    try:
        return trimesh.load_scene(path, process=False, merge_primitives=False)
    # A parser of damaged files raises whatever it stumbles over.
    except Exception as error:
        raise InputError(f"cannot be read as {path.suffix[1:].upper()} ({error})", where=path) from None


def _placed_meshes(scene: trimesh.Scene, path: Path) -> list[tuple[str, trimesh.Trimesh, Float]]:
    """(part name, mesh, 4x4 to body axes) of every mesh, in the file's order; a mesh placed twice is two parts."""
    places: dict[str, list[str]] = {name: [] for name in scene.geometry}
    for node in scene.graph.nodes_geometry:
        places[str(scene.graph[node][1])].append(node)
    found = []
    for name, nodes in places.items():
        mesh = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            continue
        for node in sorted(nodes):
            own = node if len(nodes) > 1 else name
            own = path.stem if own == path.name else own
            found.append((str(own), mesh, np.asarray(scene.graph[node][0], np.float64)))
    return found


def _part(name: str, mesh: trimesh.Trimesh, to_body: Float, material: int) -> MeshPart:
    linear, faces = to_body[:3, :3], np.asarray(mesh.faces, np.int64)
    if np.linalg.det(linear) < 0:
        faces = faces[:, ::-1]  # a mirrored face is seen from its other side
    points = np.asarray(mesh.vertices, np.float64)
    normals = None
    if "vertex_normals" in mesh._cache.cache:  # trimesh keeps the file's own there; else it would compute some
        normals = (np.asarray(mesh.vertex_normals, np.float64) @ np.linalg.inv(linear))[faces.ravel()]
    if not np.array_equal(to_body, np.eye(4)):
        points = points @ linear.T + to_body[:3, 3]
    return MeshPart(
        name=name,
        points=points,
        face_counts=np.full(len(faces), 3, np.int32),
        face_indices=faces.ravel().astype(np.int32),
        normals=normals,
        face_material=np.full(len(faces), material, np.int32),
    )


def _material(mesh: trimesh.Trimesh, exact: dict[str, Material]) -> Material | None:
    """The mesh's constant material; None where it has none."""
    found = getattr(mesh.visual, "material", None)
    if not isinstance(found, trimesh.visual.material.PBRMaterial):
        return None
    if found.name in exact:
        return exact[found.name]
    color = np.array([255, 255, 255, 255] if found.baseColorFactor is None else found.baseColorFactor) / 255
    return Material(
        path=found.name or "material",
        diffuse_color=(float(color[0]), float(color[1]), float(color[2])),
        metallic=1.0 if found.metallicFactor is None else float(found.metallicFactor),
        roughness=1.0 if found.roughnessFactor is None else float(found.roughnessFactor),
    )


def _index(materials: list[Material], material: Material) -> int:
    """Where `material` is in `materials`, entered when it is new."""
    if material not in materials:
        materials.append(material)
    return materials.index(material)

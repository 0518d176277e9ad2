"""PLY and STL, parsed by trimesh: the file's points, faces, normals and colours.

Nothing is merged, smoothed or computed.
"""

from pathlib import Path

import numpy as np
import trimesh

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.scene import srgb
from spin_usd.scene.asset import MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Primvar

DISPLAY_COLOR = "displayColor"
COLORED = ModelMaterial(constants=Material(path="vertex_colors", diffuse_color=Primvar(name=DISPLAY_COLOR)))


def read_with_trimesh(path: Path) -> MeshAsset:
    """The model in the file's own units. Raises InputError that names the file."""
    meshes = _meshes(path)
    parts = tuple(_part(path.stem if name == path.name else name, mesh) for name, mesh in meshes)
    if not parts:
        raise InputError("holds no faces", where=path)
    colored = any(DISPLAY_COLOR in part.primvars for part in parts)
    notes = ["its colours are taken as sRGB"] if colored else []
    if any(isinstance(mesh.visual, trimesh.visual.TextureVisuals) for _, mesh in meshes):
        notes.append("its texture coordinates are left out: the format defines no textures")
    return MeshAsset(name=path.stem, parts=parts, materials=(COLORED,) if colored else (), notes=tuple(notes))


def _meshes(path: Path) -> list[tuple[str, trimesh.Trimesh]]:
    """(name, mesh) of each: an STL of text may hold several solids."""
    try:
        scene = trimesh.load_scene(path, process=False)
    # A parser of damaged files raises whatever it stumbles over.
    except Exception as error:
        raise InputError(f"cannot be read as {path.suffix[1:].upper()} ({error})", where=path) from None
    meshes = [(str(name), mesh) for name, mesh in scene.geometry.items() if isinstance(mesh, trimesh.Trimesh)]
    return [(name, mesh) for name, mesh in meshes if len(mesh.faces)]


def _part(name: str, mesh: trimesh.Trimesh) -> MeshPart:
    corners = np.asarray(mesh.faces, np.int64).ravel()
    normals = None
    if "vertex_normals" in mesh._cache.cache:  # trimesh keeps the file's own there; else it would compute some
        normals = np.asarray(mesh.vertex_normals, np.float64)[corners]
    colors = _linear_colors(mesh)
    return MeshPart(
        name=name,
        points=np.asarray(mesh.vertices, np.float64),
        face_counts=np.full(len(mesh.faces), 3, np.int32),
        face_indices=corners.astype(np.int32),
        normals=normals,
        face_material=np.full(len(mesh.faces), -1 if colors is None else 0, np.int32),
        primvars={} if colors is None else {DISPLAY_COLOR: colors},
    )


def _linear_colors(mesh: trimesh.Trimesh) -> Float | None:
    """(C, 3) of the corners, made linear from sRGB; None where the file has none."""
    visual = mesh.visual
    if not isinstance(visual, trimesh.visual.ColorVisuals) or visual.kind is None:
        return None
    if visual.kind == "vertex":
        encoded = np.asarray(visual.vertex_colors)[mesh.faces.ravel(), :3] / 255
    else:
        encoded = np.repeat(np.asarray(visual.face_colors)[:, :3] / 255, 3, axis=0)
    return srgb.decode(encoded)

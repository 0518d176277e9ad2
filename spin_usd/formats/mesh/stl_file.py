"""STL, parsed by trimesh: the file's points, faces and normals.

Nothing is merged, smoothed or computed.
"""

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.text_file import refuse_long_lines
from spin_usd.scene.asset import MeshAsset, MeshPart

if TYPE_CHECKING:
    import trimesh

HEAD, FACE = 84, 50  # bytes of a binary file
LEAD = 1024  # bytes in which text identifies itself
UNNAMED = "geometry_0"
"""Name that trimesh gives the mesh of a binary file."""


def read_stl(path: Path) -> MeshAsset:
    """Read the model in the file's own units. Raises InputError that names the file."""
    parts = tuple(_part(path.stem if name == UNNAMED else name, mesh) for name, mesh in _meshes(path))
    if not parts:
        raise InputError("holds no faces", where=path)
    return MeshAsset(name=path.stem, parts=parts)


def _meshes(path: Path) -> list[tuple[str, "trimesh.Trimesh"]]:
    """Return (name, mesh) of each: an STL of text may hold several solids."""
    import trimesh  # not above: trimesh is slow to load, and few models need it

    data = read_bytes(path, MAX_MODEL)
    _refuse_damaged(data, path)
    with decoding(path):
        scene = trimesh.load_scene(io.BytesIO(data), file_type="stl", process=False)
    meshes = [(str(name), mesh) for name, mesh in scene.geometry.items() if isinstance(mesh, trimesh.Trimesh)]
    return [(name, mesh) for name, mesh in meshes if len(mesh.faces)]


def _refuse_damaged(data: bytes, path: Path) -> None:
    """Raise InputError if the file is neither as long as its head implies nor text of lines."""
    faces = int.from_bytes(data[HEAD - 4 : HEAD], "little")
    if len(data) == HEAD + FACE * faces:
        return
    if b"solid" not in data[:LEAD].lower():
        found = f"has {len(data)} bytes, and its head counts {faces} faces, for which it takes {HEAD + FACE * faces}"
        raise InputError(found, where=path, do="copy or export it again")
    refuse_long_lines(data, path)


def _part(name: str, mesh: "trimesh.Trimesh") -> MeshPart:
    corners = np.asarray(mesh.faces, np.int64).ravel()
    normals = None
    if "vertex_normals" in mesh._cache.cache:  # trimesh keeps the file's own there; else it would compute some
        normals = np.asarray(mesh.vertex_normals, np.float64)[corners]
    return MeshPart(
        name=name,
        points=np.asarray(mesh.vertices, np.float64),
        face_counts=np.full(len(mesh.faces), 3, np.int32),
        face_indices=corners.astype(np.int32),
        normals=normals,
        face_material=np.full(len(mesh.faces), -1, np.int32),
    )

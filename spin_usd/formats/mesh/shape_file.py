"""A bare shape in a file: the triangles of a mesh, or, of a PLY or OBJ file without faces, its points; metres."""

import io
from pathlib import Path

import numpy as np
from plyfile import PlyData

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.mesh.mesh_file import read_mesh_file, says_unit
from spin_usd.formats.text_file import lines_of
from spin_usd.scene.asset import MeshPart

NO_FACES = "holds no faces"
ROW = 3


def read_shape(path: Path) -> tuple[Float | None, Float | None, Float | None]:
    """Return the triangles (F, 3, 3) of a mesh, None and None; or of a cloud None, its points (N, 3), and their unit
    normals (N, 3), None where it has none. A file that does not state its unit is in metres.

    Polygons are cut into triangles around their first corner. Raises InputError for a file without either, or with
    points that are not numbers.
    """
    try:
        asset = read_mesh_file(path, None if says_unit(path) else 1.0)
    except InputError as e:
        if e.found != NO_FACES or path.suffix.lower() not in (".ply", ".obj"):
            raise
        return None, *_cloud(path)
    return np.concatenate([_triangles(part) for part in asset.parts]), None, None


def _triangles(part: MeshPart) -> Float:
    """Return the triangles (F, 3, 3) of the part and its copies."""
    counts = part.face_counts - 2
    first = np.repeat(part.face_starts, counts)
    along = np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
    corners = part.points[part.face_indices[np.stack([first, first + along, first + along + 1], -1)]]
    if part.copies is None:
        return np.asarray(corners)
    return np.concatenate([corners @ each[:3, :3].T + each[:3, 3] for each in part.copies])


def _cloud(path: Path) -> tuple[Float, Float | None]:
    """Read the points (N, 3) of a file without faces, and their normals."""
    rows = _ply_rows(path) if path.suffix.lower() == ".ply" else _obj_rows(path)
    points, normals = rows[:, :ROW], rows[:, ROW:]
    if not len(points):
        raise InputError("holds neither faces nor points", where=path, do="give a mesh or a point cloud")
    if not np.isfinite(points).all():
        raise InputError("holds points that are NaN or infinite", where=path, do="leave them out")
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    known = normals.shape[1] == ROW and np.isfinite(sizes).all() and (sizes > 0).all()
    return points, normals / sizes if known else None


def _ply_rows(path: Path) -> Float:
    with decoding(path):
        vertices = PlyData.read(io.BytesIO(read_bytes(path, MAX_MODEL)))["vertex"]
        own = {each.name for each in vertices.properties}
        names = [*"xyz", *(("nx", "ny", "nz") if {"nx", "ny", "nz"} <= own else ())]
        return np.stack([np.asarray(vertices[name], np.float64) for name in names], -1)


def _obj_rows(path: Path) -> Float:
    with decoding(path):
        rows = [line.split()[1 : ROW + 1] for line in lines_of(path, MAX_MODEL) if line.startswith("v ")]
        return np.array(rows, np.float64).reshape(-1, ROW)

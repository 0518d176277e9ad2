"""Shapes of every format as trimesh writes them, point clouds, and files that hold neither."""

import numpy as np
import pytest
import trimesh

from spin_usd.errors import InputError
from spin_usd.formats.mesh.shape_file import read_shape
from spin_usd.geometry.triangles import areas

BOX = trimesh.creation.box((1, 2, 3))
POINTS = np.random.default_rng(0).normal(size=(50, 3))


@pytest.mark.parametrize("suffix", ["ply", "obj", "stl", "glb"])
def test_a_mesh_is_its_triangles(tmp_path, suffix) -> None:
    file = tmp_path / f"box.{suffix}"
    BOX.export(file)
    corners, points, normals = read_shape(file)
    assert points is None
    assert normals is None
    assert areas(corners).sum() == pytest.approx(22)
    np.testing.assert_allclose(np.sort(corners.reshape(-1, 3), axis=0)[[0, -1]], BOX.bounds)


def test_polygons_are_cut_into_triangles(tmp_path) -> None:
    file = tmp_path / "house.obj"
    file.write_text("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 3 0\nv 0 2 0\nf 1 2 3 4 5\nf 1 2 3\n")
    corners, _, _ = read_shape(file)
    assert len(corners) == 4
    assert areas(corners).sum() == pytest.approx(5 + 2)


@pytest.mark.parametrize("suffix", ["ply", "obj"])
def test_a_file_without_faces_is_a_cloud(tmp_path, suffix) -> None:
    file = tmp_path / f"cloud.{suffix}"
    trimesh.PointCloud(POINTS).export(file)
    corners, points, normals = read_shape(file)
    assert corners is None
    assert normals is None
    np.testing.assert_allclose(points, POINTS, atol=1e-6)


def test_normals_of_a_cloud_become_unit_vectors(tmp_path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 1\n"
    names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    (tmp_path / "one.ply").write_text(f"{head}{names}end_header\n1 2 3 0 0 4\n")
    _, points, normals = read_shape(tmp_path / "one.ply")
    assert (points.tolist(), normals.tolist()) == ([[1, 2, 3]], [[0, 0, 1]])
    (tmp_path / "none.ply").write_text(f"{head}{names}end_header\n1 2 3 0 0 0\n")
    assert read_shape(tmp_path / "none.ply")[2] is None


HEAD = "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("empty.ply", "", "is empty"),
        ("picture.ply", "\x89PNG\r\n", "is not a PLY file"),
        ("cut.ply", "ply\nformat ascii 1.0\n", "has no end_header"),
        ("empty.obj", "", "holds neither faces nor points"),
        ("none.ply", HEAD.format(0), "holds neither faces nor points"),
        ("nan.ply", HEAD.format(1) + "nan 0 0\n", "NaN or infinite"),
        ("words.obj", "v one two three\n", r"words\.obj"),
        ("short.ply", HEAD.format(9) + "0 0 0\n", "counts points and faces"),
        ("shape.txt", "0 0 0\n", "is not one of the mesh formats"),
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "all faces have zero area"),
    ],
)
def test_files_without_a_shape_are_refused(tmp_path, name, text, found) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=found):
        read_shape(tmp_path / name)


def test_a_file_that_is_not_there_is_named(tmp_path) -> None:
    with pytest.raises(InputError, match="is not there"):
        read_shape(tmp_path / "ghost.ply")

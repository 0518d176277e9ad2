"""Models are whole, measured exactly, and read by others."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import pdist

from spin_usd.exchange.layout.models import Model, diameter, ply_bytes
from spin_usd.scene.instances import Instances
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import Shape

TRIANGLE = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.4, 0], [9, 9, 9]])  # no face has the last point


def shape(kind=Shape, **more):
    numbers = {"face_part": np.zeros(1, np.uint16), "face_material": np.zeros(1, np.int32)}
    normals = np.broadcast_to([0, 0, 1], (1, 3, 3)).astype(np.float32)
    return kind(points=TRIANGLE, faces=np.array([[0, 1, 2]], np.int32), corner_normals=normals, **numbers, **more)


@pytest.fixture
def model():
    """A triangle, and the same mirrored one metre higher."""
    matrix = np.array([[[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1.0]]])
    twin = Instances(shape=shape(), matrices=matrix, parts=np.ones((1, 1), np.uint16), groups=np.zeros(1, np.uint16))
    return Model.of(shape(Mesh, instances=(twin,)))


def test_instances_are_in_place_and_unused_points_are_not(model) -> None:
    assert model.points.tolist() == [[0, 0, 0], [0.3, 0, 0], [0, 0.4, 0], [0, 0, 1], [-0.3, 0, 1], [0, 0.4, 1]]
    assert model.faces.tolist() == [[0, 1, 2], [3, 5, 4]]  # mirrored, so the other way round


def test_the_file_is_in_millimetres_and_trimesh_reads_it(model, tmp_path) -> None:
    (tmp_path / "model.ply").write_bytes(ply_bytes(model))
    found = trimesh.load_mesh(tmp_path / "model.ply", process=False)
    np.testing.assert_array_equal(found.vertices, model.points * 1000)
    np.testing.assert_array_equal(found.faces, model.faces)


def test_the_diameter_of_a_box_is_its_diagonal() -> None:
    corners = np.array(np.meshgrid([0, 2], [0, 3], [0, 6])).reshape(3, -1).T + 1e4
    assert diameter(corners) == pytest.approx(7, abs=1e-12)
    assert diameter(np.ones((1, 3))) == 0


@given(st.integers(0, 2**32 - 1), st.integers(2, 40))
def test_the_diameter_is_the_largest_distance(seed, count) -> None:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    assert diameter(points) == pytest.approx(pdist(points).max(), rel=1e-14)

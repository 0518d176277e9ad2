"""A mesh refuses what no renderer may see, and has its own extent."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.errors import GeometryError
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import hull_points
from tests.cases.scenes import box, copied, soup, target

POINTS, FACES = box()
GOOD = {
    "points": POINTS,
    "faces": FACES,
    "face_part": np.ones(12),
    "face_material": np.zeros(12),
    "corner_normals": np.ones((12, 3, 3)),
}


def changed(name, index, value):
    array = np.array(GOOD[name], float)
    array[index] = value
    return {name: array}


@pytest.mark.parametrize(
    "change",
    [
        changed("points", (0, 0), np.nan),
        changed("points", (0, 0), np.inf),
        changed("faces", (0, 0), -1),
        changed("faces", (0, 0), 8),
        changed("faces", (0, 0), 2**31 - 1),
        changed("corner_normals", (0, 0, 0), np.nan),
        {"faces": np.zeros((0, 3))},
        {"faces": FACES[:, :2]},
        {"face_part": np.ones(11)},
        {"face_material": np.zeros((12, 1))},
        {"corner_normals": np.ones((12, 3))},
        {"points": np.zeros((0, 3))},
        {"points": POINTS[:, :2]},
    ],
)
def test_bad_meshes_are_refused(change) -> None:
    with pytest.raises(GeometryError, match="mesh"):
        Mesh(**{**GOOD, **change})


def test_a_mesh_cannot_be_changed_from_outside() -> None:
    points = POINTS.copy()
    mesh = Mesh(**{**GOOD, "points": points})
    key = mesh.key
    points += 1
    np.testing.assert_array_equal(mesh.points, POINTS)
    assert Mesh(**GOOD).key == key


@given(st.integers(0, 2**31))
def test_extent_holds_every_used_point(seed) -> None:
    points, faces, _ = soup(seed, count=10)
    mesh = target(np.concatenate([points, [[1e9, 0, 0]]]), faces).mesh  # a point that no face uses
    away = np.linalg.norm(points - mesh.centre, axis=1)
    assert away.max() == pytest.approx(mesh.radius)
    for direction in np.random.default_rng(seed).normal(size=(20, 3)):
        assert (mesh.hull @ direction).max() == pytest.approx((points @ direction).max())


@pytest.mark.parametrize("apart", [0.0, 1.0, 1.3])
@pytest.mark.parametrize("places", [(6, 6, 6), (6, 6, 1), (2, 1, 1)])
def test_copies_have_the_hull_of_the_same_faces_alone(monkeypatch, apart, places) -> None:
    """In one another, touching or apart, in a block, a plane or a row."""
    monkeypatch.setattr("spin_usd.scene.mesh.MANY_POINTS", 100)
    matrices = np.tile(np.eye(3, 4), (np.prod(places), 1, 1))
    matrices[:, :, 3] = apart * np.indices(places).reshape(3, -1).T
    copies = copied(target(POINTS, FACES).mesh, matrices)
    alone = hull_points(np.concatenate([points for points, _ in copies.placed]))
    np.testing.assert_array_equal(copies.hull, alone)


def test_a_flat_mesh_has_a_hull() -> None:
    mesh = target([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]], [[0, 1, 2]]).mesh
    assert len(mesh.hull) == 3


@given(st.integers(0, 2**31))
def test_each_edge_is_there_once(seed) -> None:
    points, _, _ = soup(seed, count=5)
    faces = np.random.default_rng(seed).integers(0, len(points), (12, 3))  # edges shared by any number of faces
    pairs = {tuple(sorted((int(face[i]), int(face[i - 1])))) for face in faces for i in range(3)}
    assert [tuple(edge) for edge in target(points, faces).mesh.edges.tolist()] == sorted(pairs)

"""The inside of meshes against trimesh's, and which pieces are closed."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from spin_usd.geometry.winding import closed_faces, windings

STEP = 0.07


def centres(low, shape):
    return low + (np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1) + 0.5) * STEP


def turned(mesh):
    placed = np.eye(4)
    placed[:3, :3] = Rotation.random(random_state=3).as_matrix()
    return mesh.copy().apply_transform(placed)


SHAPES = (
    trimesh.creation.torus(1.0, 0.3),
    trimesh.creation.icosphere(radius=0.9),
    trimesh.creation.box((1, 0.5, 1.4)),
    trimesh.creation.annulus(0.3, 0.8, 0.6),
)


@pytest.mark.parametrize("mesh", [*SHAPES, *map(turned, SHAPES)])
def test_the_inside_is_what_trimesh_finds(mesh) -> None:
    low, shape = mesh.bounds[0] - 0.1, (40, 41, 42)
    found = windings(mesh.triangles, low, STEP, shape)
    assert set(np.unique(found)) == {0, 1}
    places = centres(low, shape).reshape(-1, 3)
    assert np.mean((found.ravel() == 1) == mesh.contains(places)) > 0.9999  # trimesh's rays pass edges by chance


def test_the_volume_is_the_meshs() -> None:
    mesh = turned(trimesh.creation.torus(1.0, 0.3))
    found = windings(mesh.triangles, mesh.bounds[0] - 0.013, 0.02, (140, 140, 140))
    assert found.sum() * 0.02**3 == pytest.approx(mesh.volume, rel=2e-3)


def test_pieces_within_one_another_are_counted() -> None:
    outer, inner = trimesh.creation.box((2, 2, 2)), trimesh.creation.box((1, 1, 1))
    low, shape = np.full(3, -1.2), (24, 24, 24)
    both = windings(np.concatenate([outer.triangles, inner.triangles]), low, 0.1, shape)
    cavity = windings(np.concatenate([outer.triangles, inner.triangles[:, ::-1]]), low, 0.1, shape)
    assert [both.max(), cavity.max()] == [2, 1]
    assert [both.sum() * 1e-3, cavity.sum() * 1e-3] == pytest.approx([9, 7])


def test_edges_on_the_grid_leave_no_stripe() -> None:
    box = trimesh.creation.box((1, 1, 1))
    found = windings(box.triangles, np.full(3, -0.55), 0.1, (11, 11, 11))  # centres on the faces and the diagonals
    assert set(np.unique(found[1:-1, 1:-1, 1:-1])) == {1}


def test_a_box_is_closed_until_a_face_is_lost() -> None:
    box, sheet = trimesh.creation.box((1, 1, 1)), np.array([[[3, 0, 0], [4, 0, 0], [3, 1, 0.0]]])
    corners = np.concatenate([box.triangles, box.triangles[1:] + 5, sheet])
    points, faces = corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)  # no two faces share a point
    closed = closed_faces(points, faces)
    assert closed.tolist() == [True] * 12 + [False] * 12
    turned_over = corners[:12].copy()
    turned_over[0] = turned_over[0, ::-1]
    assert not closed_faces(turned_over.reshape(-1, 3), faces[:12]).any()

"""A bulge leaves borders where they are, is as high as it says, and moves each flat face along its normal."""

import numpy as np
import pytest
import trimesh

from spin_usd.geometry.bulge import bulged, bulged_normals, flat_faces, longest_edge
from spin_usd.geometry.splitting import split_edges

HEIGHT = 0.03
BORDER = 1e-8


def box_split(fineness):
    """A box, split, and its flat faces."""
    made = trimesh.creation.box((2.0, 1.0, 0.5))
    points, corners = np.asarray(made.vertices, np.float64), np.asarray(made.faces, np.int64)
    longest = longest_edge(points, corners) / fineness
    split = split_edges(points, corners, lambda a, b: np.linalg.norm(a - b, axis=1) > longest)
    return split.points, split.corners, flat_faces(points, corners)[split.of]


@pytest.fixture(scope="module")
def box():
    return box_split(1)


def test_a_box_has_six_flat_faces(box) -> None:
    points, corners, faces = box
    assert len(np.unique(faces)) == 6
    for face in range(6):
        assert np.ptp(points[corners[faces == face]].reshape(-1, 3), axis=0).min() < BORDER


def test_it_is_zero_at_the_borders_and_as_high_as_it_says(box) -> None:
    points, corners, faces = box
    moves = bulged(points, corners, faces, HEIGHT) - points
    on_edges = (np.abs(np.abs(points) - (1, 0.5, 0.25)) < BORDER).sum(1) >= 2
    assert on_edges.any()
    assert not moves[on_edges].any()
    assert np.linalg.norm(moves, axis=1).max() == pytest.approx(HEIGHT, rel=1e-12)
    assert np.linalg.norm(moves[~on_edges], axis=1).min() > 0
    at_top = points[np.argmax(np.linalg.norm(moves, axis=1))]
    np.testing.assert_allclose(np.abs(at_top), (0, 0, 0.25), atol=longest_edge(points, corners))


def test_it_goes_outwards_along_the_normals_and_keeps_the_surface_closed(box) -> None:
    points, corners, faces = box
    after = bulged(points, corners, faces, HEIGHT)
    moves = after - points
    assert ((moves != 0).sum(1) <= 1).all()  # of a box: along one axis
    assert (moves * np.sign(points) >= 0).all()
    mesh = trimesh.Trimesh(after, corners, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 1.0


def test_a_dent_is_the_opposite(box) -> None:
    points, corners, faces = box
    out, inwards = (bulged(points, corners, faces, height) - points for height in (HEIGHT, -HEIGHT))
    np.testing.assert_allclose(out, -inwards, atol=1e-15)


def normals_off(fineness):
    """The largest angle between the followed normals of a bulged box and its triangles', and between the flat ones'."""
    points, corners, faces = box_split(fineness)
    flat = np.repeat(trimesh.Trimesh(points, corners, process=False).face_normals[:, None], 3, axis=1)
    after = bulged(points, corners, faces, HEIGHT)
    normals = bulged_normals(flat, points, after, corners)
    still = (after == points).all(1)[corners]
    np.testing.assert_array_equal(normals[still], flat[still])
    true = trimesh.Trimesh(after, corners, process=False).face_normals
    return [np.arccos(np.clip((each.mean(1) * true).sum(1), -1, 1)).max() for each in (normals, flat)]


def test_normals_follow_the_better_the_finer_the_mesh() -> None:
    (coarse, flat), (fine, _) = normals_off(1), normals_off(4)
    assert coarse < flat / 2
    assert fine < coarse / 2  # to first order, in the length of an edge

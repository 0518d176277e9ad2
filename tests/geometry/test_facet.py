"""Facets: what lies in one plane is one face, however it is divided."""

import numpy as np
import pytest
import trimesh

from spin_usd.geometry.facet import Facet
from spin_usd.geometry.rotation import matrix_from_quaternion

EXACT = 1e-12  # of metres: sums of a few doubles of about one
SIZE = np.array([1.0, 0.6, 0.4])


def box(divisions):
    """A box of SIZE, turned, each of its triangles divided in four so often."""
    mesh = trimesh.creation.box(SIZE)
    for _ in range(divisions):
        mesh = mesh.subdivide()
    return np.array(mesh.vertices) @ turn().T, np.array(mesh.faces)


def turn():
    return matrix_from_quaternion(np.array([0.5, 0.1, -0.7, 0.5]) / np.linalg.norm([0.5, 0.1, -0.7, 0.5]))


@pytest.mark.parametrize("divisions", [0, 1, 3])
def test_a_box_has_six_faces_of_four_edges(divisions) -> None:
    points, faces = box(divisions)
    centres, edges = [], []
    for face in range(len(faces)):
        facet = Facet.around(points, faces, face)
        centres.append(facet.centre)
        edges.append(facet.edge_midpoints)
        assert len(facet.corners) == len(faces) / 6
        assert facet.edges.shape == (4, 2, 3)
    assert len(np.unique(np.round(centres, 9) + 0.0, axis=0)) == 6
    assert len(np.unique(np.round(np.concatenate(edges), 9) + 0.0, axis=0)) == 12


def test_the_centre_and_the_midpoints_are_those_of_the_box() -> None:
    points, faces = box(2)
    facet = Facet.around(points, faces, 0)
    body = facet.centre @ turn()
    side = int(np.argmax(np.abs(body)))
    assert np.abs(body) == pytest.approx(np.where(np.arange(3) == side, SIZE / 2, 0), abs=EXACT)
    middles = np.abs(facet.edge_midpoints @ turn())
    for axis in {0, 1, 2} - {side}:
        expected = np.where((np.arange(3) == axis) | (np.arange(3) == side), SIZE / 2, 0)
        assert (np.abs(middles - expected).max(1) < EXACT).sum() == 2


def test_what_lies_in_the_plane_elsewhere_and_the_back_of_a_plate_are_other_faces() -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    points = np.concatenate([square, square + np.array([3, 0, 0]), square])
    front = np.array([[0, 1, 2], [0, 2, 3]])
    faces = np.concatenate([front, front + 4, front[:, ::-1] + 8])
    assert Facet.around(points, faces, 1).vertices.tolist() == np.unique(square, axis=0).tolist()
    assert len(Facet.around(points, faces, 5).corners) == 2


def test_a_disc_of_triangles_has_its_middle_among_its_vertices_and_no_edge_there() -> None:
    turns = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    points = np.concatenate([[[0, 0, 1.0]], np.stack([np.cos(turns), np.sin(turns), np.ones(12)], -1)])
    faces = np.array([[0, 1 + i, 1 + (i + 1) % 12] for i in range(12)])
    facet = Facet.around(points, faces, 4)
    assert len(facet.vertices) == 13
    assert len(facet.edges) == 12
    assert facet.centre == pytest.approx([0, 0, 1], abs=EXACT)

"""Texture coordinates by projection, held against what they promise: metres, no seam in a region, little stretch."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from spin_usd.geometry.box_projection import Polygons, projected, stretch

DENSITY, STRETCH = 1.5, 2.0  # the most that a pattern may differ in size over a surface, and be drawn out
TURNED = Rotation.from_euler("xyz", [33, 21, 57], degrees=True).as_matrix()
SOLIDS = {
    "box": trimesh.creation.box((1.0, 2.0, 0.1)),
    "sphere": trimesh.creation.icosphere(4),
    "cylinder": trimesh.creation.cylinder(0.3, 3, sections=64),
    "tube": trimesh.creation.torus(1, 0.1),
    "cone": trimesh.creation.cone(1, 2),
    "capsule": trimesh.creation.capsule(),
    "ellipsoid": trimesh.creation.icosphere(4).apply_transform(np.diag([2, 1, 0.3, 1])),
}


def polygons_of(mesh: trimesh.Trimesh, rotation: np.ndarray = TURNED) -> Polygons:
    return Polygons(
        points=mesh.vertices @ rotation.T,
        counts=np.full(len(mesh.faces), 3),
        indices=np.asarray(mesh.faces, np.int64).reshape(-1),
    )


@pytest.mark.parametrize("rotation", [np.eye(3), TURNED], ids=["along the axes", "turned"])
@pytest.mark.parametrize("solid", SOLIDS)
def test_a_pattern_is_of_one_size_and_hardly_drawn_out(solid: str, rotation: np.ndarray) -> None:
    polygons = polygons_of(SOLIDS[solid], rotation)
    longest, shortest = stretch(polygons, projected(polygons)).T
    density = np.sqrt(longest * shortest)
    assert density.max() <= 1 + 1e-9 < DENSITY * density.min()
    assert (longest / shortest).max() < STRETCH


def test_a_flat_face_is_measured_in_metres_wherever_it_lies() -> None:
    polygons = polygons_of(trimesh.creation.box((0.5, 2.0, 0.1)).apply_translation((1e4, 2e4, -3e4)))
    np.testing.assert_allclose(stretch(polygons, projected(polygons)), 1, atol=1e-7)


def test_a_gently_curved_panel_has_no_seam() -> None:
    """Of a quarter of a tube, all corners at one point have one place in the pattern; a whole tube must have seams."""
    angle, height = np.meshgrid(np.linspace(0, np.pi / 2, 33), np.linspace(0, 1, 9), indexing="ij")
    points = np.stack([np.cos(angle), np.sin(angle), height], -1).reshape(-1, 3) @ TURNED.T
    first = np.add.outer(np.arange(32) * 9, np.arange(8)).reshape(-1)
    indices = (first[:, None] + [0, 9, 10, 1]).reshape(-1)
    st = projected(Polygons(points=points, counts=np.full(len(first), 4), indices=indices))
    places = np.full((len(points), 2), np.nan)
    places[indices] = st
    np.testing.assert_allclose(st, places[indices], atol=1e-12)


def test_a_plate_keeps_its_plane_whatever_its_rounded_edges_do() -> None:
    """A ball that is a cube in the middle: each of its six flat faces, though turned, is one region in metres."""
    cube = trimesh.creation.box().subdivide_loop(0).subdivide().subdivide().subdivide()
    inner = np.clip(cube.vertices, -0.4, 0.4)
    away = cube.vertices - inner
    cube.vertices = inner + 0.1 * away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
    polygons = polygons_of(cube)
    st = projected(polygons)
    normals = cube.face_normals
    flat = np.abs(normals).max(1) > 1 - 1e-9
    assert flat.sum() > 100
    np.testing.assert_allclose(stretch(polygons, st)[flat], 1, atol=1e-6)


def test_points_that_are_not_shared_are_neighbours_all_the_same() -> None:
    whole = polygons_of(SOLIDS["capsule"])
    alone = Polygons(
        points=whole.points[whole.indices], counts=whole.counts, indices=np.arange(len(whole.indices), dtype=np.int64)
    )
    np.testing.assert_array_equal(projected(alone), projected(whole))


def test_the_pattern_goes_on_over_faces_of_one_plane_and_is_never_mirrored() -> None:
    box = polygons_of(trimesh.creation.box(), np.eye(3))
    st = projected(box).reshape(-1, 3, 2)
    assert (np.linalg.det(np.stack([st[:, 1] - st[:, 0], st[:, 2] - st[:, 0]], -1)) > 0).all()
    upright = np.abs(box.area_normals[:, 2]) < 1e-9
    heights = box.points[box.indices.reshape(-1, 3)][..., 2]
    np.testing.assert_allclose(st[upright][..., 1], heights[upright], atol=1e-12)


def test_faces_without_an_area_do_no_harm() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]])
    polygons = Polygons(points=points, counts=np.array([3, 3]), indices=np.array([0, 1, 2, 0, 1, 3]))
    assert np.isfinite(projected(polygons)).all()

"""Faces that lie in one another: planted ones are found, whatever the mesh's place, size and order, and no others."""

import time

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.geometry.triangles import areas
from spin_usd.scene.derived.coincidence import GAP, MAX_MIDDLES, coincident_faces, evenly_spread
from tests.cases.scenes import box, copied, soup, target, unit_quaternions

SECONDS = 20.0  # for 200,000 faces; measured 1


def planted(seed, gap):
    """Random triangles and, as the last, a smaller one in the middle of one of them, `gap` radii before it."""
    points, faces, _ = soup(seed)
    rng = np.random.default_rng(seed)
    host = int(rng.integers(len(faces)))
    corners = points[faces[host]]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    own = corners.mean(0) + 0.3 * (corners - corners.mean(0))[rng.permutation(3)]
    own += gap * target(points, faces).mesh.radius * normal / np.linalg.norm(normal)
    return np.concatenate([points, own]), np.concatenate([faces, [len(points) + np.arange(3)]]), host


def pairs(points, faces):
    mesh = target(points, faces).mesh
    return {(int(a), int(b)) for a, b in coincident_faces(mesh, evenly_spread(mesh))}


@pytest.mark.parametrize("seed", range(25))
def test_every_planted_face_is_found(seed) -> None:
    for gap in (0.0, 0.9 * GAP):
        points, faces, host = planted(seed, gap)
        assert (len(faces) - 1, host) in pairs(points, faces)


@pytest.mark.parametrize("seed", range(25))
def test_faces_that_a_renderer_can_tell_apart_are_none(seed) -> None:
    points, faces, _ = planted(seed, 1.1 * GAP)
    assert pairs(points, faces) == set()


@settings(max_examples=25)
@given(unit_quaternions(), st.sampled_from([1e-3, 1.0, 1e3]), st.integers(0, 9))
def test_place_size_and_order_do_not_matter(q, size, seed) -> None:
    points, faces, _ = planted(seed, 0.0)
    moved = size * (points @ matrix_from_quaternion(q).T + 1000.0 * np.array([1, -2, 3]))
    assert pairs(moved, faces) == pairs(points, faces)
    assert pairs(points, faces[::-1]) == {tuple(len(faces) - 1 - i for i in pair) for pair in pairs(points, faces)}


def test_a_mesh_with_every_face_twice() -> None:
    """The same way round or the other: each with its twin, both ways."""
    points, faces = box()
    for twin in (faces, faces[:, ::-1]):
        count = len(faces)
        expected = {(i, i + count) for i in range(count)} | {(i + count, i) for i in range(count)}
        assert pairs(points, np.concatenate([faces, twin])) == expected


def test_closed_bodies_have_none() -> None:
    for made in (
        trimesh.creation.icosphere(subdivisions=3),
        trimesh.creation.capsule(),
        trimesh.creation.annulus(0.9, 1.0, 0.1),
    ):
        assert pairs(made.vertices, made.faces) == set()


def test_many_faces_take_seconds() -> None:
    """200,000 in one plane, twice: the worst that a plane can be."""
    side = 224
    x, y = np.meshgrid(np.arange(side + 1.0), np.arange(side + 1.0))
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], -1)
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    half = (
        np.stack([corner, corner + 1, corner + side + 2], -1),
        np.stack([corner, corner + side + 2, corner + side + 1], -1),
    )
    faces = np.concatenate([*half, *half])
    started = time.process_time()
    mesh = target(points, faces).mesh
    looked_at = evenly_spread(mesh)
    found = coincident_faces(mesh, looked_at)
    assert time.process_time() - started < SECONDS
    assert MAX_MIDDLES / 2 < len(looked_at) <= MAX_MIDDLES
    np.testing.assert_array_equal(np.unique(found[:, 0]), looked_at)
    assert areas(mesh.points[mesh.faces]).sum() == pytest.approx(2 * side**2)


@pytest.mark.parametrize(("count", "spread"), [(2, 0.0), (20, 3.0), (50, 40.0)])
@pytest.mark.parametrize("scales", [(1, 1, 1), (-1, 1, 1), (1, 2, 0.5)])
@pytest.mark.parametrize("step", [2, 23])
def test_copies_have_the_pairs_of_the_same_faces_alone(count, spread, scales, step) -> None:
    """In one another or apart, turned, mirrored, stretched; of few middles a copy, and of many."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    doubled = np.concatenate([ball.faces, ball.faces[:40]])
    rng = np.random.default_rng(count)
    matrices = np.zeros((count, 3, 4))
    matrices[..., :3] = [matrix_from_quaternion(q / np.linalg.norm(q)) for q in rng.normal(size=(count, 4))]
    matrices[..., :3] *= rng.uniform(0.5, 1, (count, 1, 1)) * scales
    matrices[1:, :, 3] = rng.uniform(-spread, spread, (count - 1, 3))
    matrices[-1] = matrices[0]
    copies = copied(target(ball.vertices, doubled).mesh, matrices)
    alone = target(
        np.concatenate([points for points, _ in copies.placed]),
        np.concatenate([faces + i * len(ball.vertices) for i, (_, faces) in enumerate(copies.placed)]),
    ).mesh
    looked_at = np.arange(0, copies.count, step)
    found, expected = coincident_faces(copies, looked_at), coincident_faces(alone, looked_at)
    assert len(found)
    np.testing.assert_array_equal(np.unique(found, axis=0), np.unique(expected, axis=0))

"""A bend keeps lengths on its middle surface, curves it evenly, and turns normals with the surface."""

import numpy as np
import pytest

from spin_usd.geometry.bend import SAGITTA, Bend
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.geometry.splitting import split_edges

LENGTH = 1.7
ROUNDED = 1e-12


def bend(angle: float, place: bool = True) -> Bend:
    frame = np.eye(4)
    if place:
        frame[:3, :3] = matrix_from_quaternion([0.8, 0.4, -0.2, 0.4])
        frame[:3, 3] = (0.3, -2.0, 5.0)
    return Bend(frame=frame, length=LENGTH, angle=angle)


def in_body(bent: Bend, local):
    return np.asarray(local) @ bent.frame[:3, :3].T + bent.frame[:3, 3]


@pytest.mark.parametrize("angle", [1e-6, 0.1, -0.7, 3.0])
def test_the_middle_surface_is_an_arc_of_the_same_length(angle) -> None:
    bent, x = bend(angle), np.linspace(0, LENGTH, 2001)
    points = bent.points(in_body(bent, np.stack([x, 0 * x + 0.2, 0 * x], axis=1)))
    steps = np.diff(points, axis=0)
    chord = 2 * np.sin(angle / 4000) / (angle / LENGTH)  # of each step's arc: its length is LENGTH / 2000
    np.testing.assert_allclose(np.linalg.norm(steps, axis=1), chord, rtol=1e-9)
    turns = np.linalg.norm(np.cross(steps[:-1], steps[1:]), axis=1) / np.linalg.norm(steps[1:], axis=1) ** 2
    np.testing.assert_allclose(turns, abs(np.sin(angle / 2000)), rtol=1e-6, atol=1e-9)  # the same at each step
    ends = steps[[0, -1]] / np.linalg.norm(steps[[0, -1]], axis=1)[:, None]
    assert np.arccos(np.clip(ends[0] @ ends[1], -1, 1)) == pytest.approx(abs(angle), rel=1e-3, abs=1e-7)


def test_it_bends_towards_z_and_only_between_start_and_end() -> None:
    bent = bend(np.pi / 2, place=False)
    radius = LENGTH / (np.pi / 2)
    places = bent.points(np.array([[-1, 0, 0.1], [LENGTH, 0, 0], [LENGTH + 2, 0.5, 0]]))
    np.testing.assert_allclose(places, [[-1, 0, 0.1], [radius, 0, radius], [radius, 0.5, radius + 2]], atol=ROUNDED)


def test_none_is_the_identity() -> None:
    points = np.random.default_rng(1).normal(size=(50, 3))
    np.testing.assert_allclose(bend(0.0).points(points), points, atol=ROUNDED)


def test_normals_stay_square_to_the_surface() -> None:
    bent, rng = bend(1.1), np.random.default_rng(2)
    points = in_body(bent, rng.uniform((0.1, -1, -0.2), (LENGTH - 0.1, 1, 0.2), (100, 3)))
    normals = rng.normal(size=(100, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    across = np.cross(normals, rng.normal(size=(100, 3)))
    step = 1e-6
    moved = (bent.points(points + step * across) - bent.points(points - step * across)) / (2 * step)
    assert np.abs((bent.normals(points, normals) * moved).sum(1)).max() < 1e-8


def test_a_split_plate_stays_near_the_arc() -> None:
    bent = bend(1.5)
    corners = np.array([[0, 1, 2], [0, 2, 3]])
    plate = in_body(bent, [[0, 0, 0], [LENGTH, 0, 0], [LENGTH, 1, 0], [0, 1, 0]])
    split = split_edges(plate, corners, bent.too_long)
    middles = split.points[split.corners].mean(1)
    off = np.linalg.norm(bent.points(split.points)[split.corners].mean(1) - bent.points(middles), axis=1)
    assert 0 < off.max() <= SAGITTA * LENGTH

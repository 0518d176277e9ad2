"""Rays, points and cones against ellipsoids: spheres by hand, others by sampling their surfaces."""

import numpy as np
import pytest
from scipy.optimize import minimize

from spin_usd.geometry.ellipsoid import distance, meets_cone, rays_meet

EARTH = np.array([6378137, 6378137, 6356752.3142])
ROUNDING = 1e-9  # metres: of coordinates of 6.4e6 m in double precision


def test_rays_graze_a_sphere_at_its_angular_radius() -> None:
    """From a metre above Earth's radius to as far as the Sun; behind the start there is nothing."""
    for away in (1 + 1e-7, 1.1, 60, 23000):
        start, edge = np.array([0, 0, away * 7.0]), np.arcsin(1 / away)
        angles = np.array([edge * (1 - 1e-6), edge * (1 + 1e-6)])
        rays = np.stack([np.sin(angles), 0 * angles, -np.cos(angles)], -1)
        np.testing.assert_array_equal(rays_meet(np.full(3, 7.0), start, rays), [True, False])
        assert not rays_meet(np.full(3, 7.0), start, -rays).any()


def test_distance_is_the_height_from_which_a_point_was_made() -> None:
    """Points raised along the normals of Earth, of a needle and of a disc."""
    rng = np.random.default_rng(0)
    for radii, heights in ((EARTH, (1e-3, 5, 4e5, 4e8)), (np.array([1, 1, 9.0]), (1e-3, 1, 1e6)), (np.array([5, 9, 0.1]), (1e-3, 3e6))):  # fmt: skip  # noqa: E501
        unit = rng.standard_normal((200, 3))
        unit /= np.linalg.norm(unit, axis=1, keepdims=True)
        normal = unit / radii
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        for height in heights:
            found = distance(radii, radii * unit + height * normal)
            np.testing.assert_allclose(found, height, rtol=1e-9, atol=4 * ROUNDING)
        assert not distance(radii, 0.999 * radii * unit).any()


def test_distance_at_the_centre_and_far_out() -> None:
    assert distance(EARTH, np.zeros((1, 3)))[0] == 0
    assert distance(np.full(3, 1e-3), np.array([[0, 0, 1e15]]))[0] == pytest.approx(1e15)


def test_a_cone_meets_a_sphere_where_their_outlines_do() -> None:
    """Where the sphere's centre is as far from the cone's side as its radius, and from the ball behind the cone."""
    sine, radius = 0.3, 2.0
    cosine, ball = np.sqrt(1 - sine**2), 10 * sine
    for along in (3.0, 6.0):
        side = (along * sine + radius) / cosine  # its centre, beside the axis at `along`, touching the side
        for gap, meets in ((1e-6, False), (-1e-6, True)):
            apex, centre = -np.array([side + gap, 0, along]), np.array([-side - gap, 0, 10 - along])
            assert meets_cone(np.full(3, radius), apex, centre, ball) == meets
    for gap, meets in ((1e-6, False), (-1e-6, True)):
        start = -np.array([0, 0, 10 + ball + radius + gap])
        assert meets_cone(np.full(3, radius), start, start + np.array([0, 0, 10]), ball) == meets


@pytest.mark.parametrize("seed", range(20))
def test_a_cone_meets_an_ellipsoid_where_a_search_finds_them_to(seed) -> None:
    """The least gap over the cone's axis and the ellipsoid's surface at once, by another method."""
    rng = np.random.default_rng(seed)
    radii, apex = rng.uniform(0.5, 4, 3), rng.uniform((-1, -1, 8), (1, 1, 10))
    centre, radius = rng.uniform(-8, 8, 3), rng.uniform(0, 2)

    def gap(v):
        on = np.array([np.cos(v[0]) * np.cos(v[1]), np.sin(v[0]) * np.cos(v[1]), np.sin(v[1])]) * radii
        s = np.clip(v[2], 0, 1)
        return np.linalg.norm(apex + s * (centre - apex) - on) - s * radius

    starts = rng.uniform((-np.pi, -1.5, 0), (np.pi, 1.5, 1), (12, 3))
    least = min(minimize(gap, start, method="Nelder-Mead").fun for start in starts)
    inside = distance(radii, apex + np.linspace(0, 1, 999)[:, None] * (centre - apex)).min() == 0
    if inside or abs(least) > 1e-3:
        assert meets_cone(radii, apex, centre, radius) == (inside or least < 0)

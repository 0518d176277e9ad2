"""Beam patterns: unit directions, evenly spaced as each pattern says, in x forward, y left, z up."""

import numpy as np
import pytest

from spin_usd.scene.lidar import PATTERNS, beam_directions

ROUNDING = 1e-14
AZIMUTH, ELEVATION = (-30.0, 20.0), (-10.0, 15.0)


def angles(directions):
    """Azimuth and elevation of directions (N, 3), degrees."""
    x, y, z = directions.T
    return np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y)))


@pytest.mark.parametrize("pattern", PATTERNS)
def test_directions_are_unit_and_read_only(pattern) -> None:
    found = beam_directions(pattern, 7, 11, AZIMUTH, ELEVATION)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, rtol=0, atol=ROUNDING)
    assert found.shape == (77, 3)
    assert not found.flags.writeable


def test_a_raster_is_even_on_its_plane_from_the_top_left() -> None:
    found = beam_directions("raster", 4, 5, AZIMUTH, ELEVATION).reshape(4, 5, 3)
    y, z = found[..., 1] / found[..., 0], found[..., 2] / found[..., 0]
    right, left = np.tan(np.radians(AZIMUTH))
    bottom, top = np.tan(np.radians(ELEVATION))
    np.testing.assert_allclose(y[2], left + (right - left) * np.array([0.1, 0.3, 0.5, 0.7, 0.9]), atol=ROUNDING)
    np.testing.assert_allclose(z[:, 3], top + (bottom - top) * np.array([0.125, 0.375, 0.625, 0.875]), atol=ROUNDING)


def test_a_spinning_pattern_is_rings_of_equal_steps_clockwise_from_above() -> None:
    found = beam_directions("spinning", 3, 8, (-180.0, 180.0), ELEVATION)
    azimuth, elevation = (each.reshape(3, 8) for each in angles(found))
    np.testing.assert_allclose(elevation, np.repeat([[15.0], [2.5], [-10.0]], 8, 1), atol=1e-12)
    np.testing.assert_allclose(azimuth, np.repeat([np.arange(157.5, -180, -45)], 3, 0), atol=1e-12)


def test_one_ring_is_in_the_middle() -> None:
    assert angles(beam_directions("spinning", 1, 4, AZIMUTH, ELEVATION))[1] == pytest.approx(2.5)


def test_a_rosette_fills_its_span_and_never_closes() -> None:
    found = beam_directions("rosette", 50, 200, (-20.0, 20.0), (-20.0, 20.0))
    plane = found[:, 1:] / found[:, :1] / np.tan(np.radians(20))
    radius = np.linalg.norm(plane, axis=1)
    assert 0.99 < radius.max() <= 1 + ROUNDING
    assert len(np.unique(np.round(plane, 9), axis=0)) == len(plane)
    turns, _ = np.histogram(np.arctan2(*plane.T), 12, (-np.pi, np.pi))
    assert turns.min() > 0.9 * turns.max()  # no direction is left out

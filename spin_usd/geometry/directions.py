"""Directions spread evenly over all sides: along a spiral whose turns are golden angles."""

import numpy as np

from spin_usd.basics.arrays import Float

GOLDEN_ANGLE = np.pi * (3 - 5**0.5)


def sphere(count: int) -> Float:
    """Return (count, 3) unit vectors spread evenly all around."""
    return _spiral(1 - 2 * _middles(count))


def half_sphere(count: int) -> Float:
    """Return (count, 3) unit vectors spread evenly over the half with z > 0."""
    return _spiral(_middles(count))


def _middles(count: int) -> Float:
    """Return (count,) of as many equal parts of 0 to 1: bands of as much height have the same area."""
    return (np.arange(count) + 0.5) / count


def _spiral(z: Float) -> Float:
    """Unit vectors (N, 3) of these heights, each a golden angle further around than the one before."""
    turn, across = GOLDEN_ANGLE * (np.arange(len(z)) + 0.5), np.sqrt(1 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], -1)

"""Ellipsoids in their own axes, with semi-axes `radii` (3,): the rays that meet them, and the distances of points.

All in double precision, and without the difference of two large numbers: a planet's radius is millions of times the
height over it that counts.
"""

import numpy as np

from spin_usd.basics.arrays import Float

NEWTON_STEPS = 200  # at most; from far away each step comes 1.5 times nearer, in the end it doubles the digits
CONE_STEPS = 33  # places along a cone's axis that are looked at at once
CONE_ROUNDS = 12  # each narrows the place of the least gap 16 times: to double precision


def rays_meet(radii: Float, start: Float, directions: Float) -> np.ndarray:
    """Return (N,) True where the rays from `start` (3,) outside, along `directions` (N, 3), meet the ellipsoid."""
    o, d = start / radii, directions / radii  # the ellipsoid is the unit sphere
    aside = np.cross(o, d)
    passes = (aside * aside).sum(1) < (d * d).sum(1)
    return np.asarray(passes & (d @ o < 0))


def distance(radii: Float, points: Float) -> Float:
    """Return (N,) distance of the points (N, 3) from the ellipsoid, 0 inside it.

    The nearest point of the surface is radii^2 p / (t + radii^2), with t the one root of |radii p / (t + radii^2)| = 1
    that is not negative; its square falls and is convex in t, so that Newton's steps from below never pass the root.
    Source: D. Eberly, "Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid" (2013).
    """
    square = radii * radii
    t = np.maximum((radii * np.abs(points) - square).max(1), 0.0)  # where one of the three terms alone is 1
    for _ in range(NEWTON_STEPS):
        terms = radii * points / (t[:, None] + square)
        excess = (terms * terms).sum(1) - 1
        slope = 2 * (terms * terms / (t[:, None] + square)).sum(1)
        step = np.where(excess > 0, excess / np.maximum(slope, np.finfo(float).tiny), 0.0)
        if not (t + step > t).any():
            break
        t += step
    away: Float = np.linalg.norm(points * (t[:, None] / (t[:, None] + square)), axis=1)
    return away


def meets_cone(radii: Float, apex: Float, centre: Float, radius: float) -> bool:
    """Return whether the ellipsoid meets the cone from `apex` (3,) around a ball, or the ball itself.

    They are the balls of radius s `radius` at apex + s (centre - apex), s from 0 to 1. The gap between ball and
    ellipsoid is convex in s, for the ellipsoid is: its least value lies beside the least of any row of places.
    """
    low, high = 0.0, 1.0
    if _nearest(apex, centre) - radius > radii.max():  # as is usual: the ball around the ellipsoid is far from it all
        return False
    for _ in range(CONE_ROUNDS):
        s = np.linspace(low, high, CONE_STEPS)
        gap = distance(radii, apex + s[:, None] * (centre - apex)) - s * radius
        least = int(np.argmin(gap))
        if gap[least] <= 0:
            return True
        low, high = s[max(least - 1, 0)], s[min(least + 1, CONE_STEPS - 1)]
    return False


def _nearest(start: Float, end: Float) -> float:
    """Return the least distance of the straight line from `start` to `end` (3,) from the origin."""
    along = end - start
    square = float(along @ along)
    s = min(max(-float(start @ along) / square, 0.0), 1.0) if square else 0.0
    return float(np.linalg.norm(start + s * along))

"""The first triangle on each ray, by the method of Möller and Trumbore (1997), in double precision."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class FirstHit:
    """face: index of the nearest triangle (N,), -1 where there is none · distance: along the ray in its own lengths
    (N,), infinite where there is none · sure (N,): no triangle's edge, and no second triangle, is so near that
    rounding may decide otherwise."""

    face: NDArray[np.intp]
    distance: Float
    sure: NDArray[np.bool_]


def first_hit(directions: Float, triangles: Float, *, doubt: float, apart: float | None = None) -> FirstHit:
    """Rays from the origin along `directions` (N, 3) against `triangles` (M, 3, 3). `doubt`: what counts as near, in
    barycentric coordinates and, unless `apart` says that, relative to the distance."""
    apart = doubt if apart is None else apart
    a, b, c = (triangles[:, i] for i in range(3))
    along = np.cross(directions[:, None], (c - a)[None])
    volume = np.sum(along * (b - a), 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.sum(along * -a, 2) / volume
        across = np.cross(-a, b - a)
        v = directions @ across.T / volume
        distance = np.sum((c - a) * across, 1) / volume
    inside = np.minimum(np.minimum(u, v), 1 - u - v)
    near = np.where((inside >= 0) & (distance > 0), distance, np.inf)
    face = near.argmin(1)
    first, second = np.partition(near, 1, axis=1)[:, :2].T
    hit = np.isfinite(first)
    on_edge = (np.abs(inside) < doubt) & (distance > 0) & (distance <= first[:, None] * (1 + apart))
    close = np.isfinite(second) & (second <= first * (1 + apart))
    return FirstHit(face=np.where(hit, face, -1), distance=first, sure=~on_edge.any(1) & ~close)

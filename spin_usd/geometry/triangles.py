"""Triangles by their corners: their normals and areas."""

import numpy as np

from spin_usd.arrays import Float


def normals(corners: Float) -> Float:
    """Return (..., 3) normals of the triangles `corners` (..., 3, 3), whose corners go around them counter-clockwise:
    as long as twice the area."""
    a, b, c = np.moveaxis(corners, -2, 0)
    return np.cross(b - a, c - a)


def unit_normals(corners: Float) -> Float:
    """Return (..., 3) as `normals`, at length 1; 0 where there is no area."""
    along = normals(corners)
    along /= np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), np.finfo(float).tiny)
    return along


def areas(corners: Float) -> Float:
    """Return (...) areas of the triangles `corners` (..., 3, 3)."""
    area: Float = np.linalg.norm(normals(corners), axis=-1) / 2
    return area


def affine(matrices: Float, points: Float) -> Float:
    """Return (..., 3) the `points` (..., N, 3) moved by the matrices (..., 3, 4). Number by number, so that a point's
    place is the same to the bit however many are moved with it, which no matrix product promises."""
    x, y, z = (points[..., i : i + 1] for i in range(3))
    moved: Float = x * matrices[..., 0] + y * matrices[..., 1] + z * matrices[..., 2] + matrices[..., 3]
    return moved


def unit_vectors(vectors: Float) -> Float:
    """Return the vectors (..., 3) at length 1; 0 stays 0."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), np.finfo(float).tiny)

"""The inside of triangle meshes: which of their pieces are closed, and which cells of a grid these enclose.

Of an open piece, such as a sheet of film, no inside is defined.
"""

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

FACES_AT_ONCE = 256  # each over at most all columns of a grid
ASIDE = np.array([1.3e-6, 0.7e-6])  # of a cell, by which columns pass edges that lie on the grid


def closed_faces(points: Float, faces: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Return (F,) which of the faces (F, 3) belong to closed pieces: all of whose edges, between welded points, are run
    through as often in one direction as in the other."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    _, welded = np.unique(points, axis=0, return_inverse=True)
    corners = welded.reshape(-1)[faces]
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], -1).reshape(-1, 2)
    _, edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    balance = np.bincount(edge, weights=np.sign(ends[:, 1] - ends[:, 0]))
    owner, count = np.repeat(np.arange(len(faces)), 3), len(faces) + len(balance)
    graph = coo_array((np.ones(len(edge), np.int8), (owner, len(faces) + edge)), shape=(count, count))
    piece = connected_components(graph, directed=False)[1]
    open_pieces = np.unique(piece[len(faces) + np.flatnonzero(balance)])
    return ~np.isin(piece[: len(faces)], open_pieces)


def windings(corners: Float, low: Float, step: float, shape: tuple[int, int, int]) -> NDArray[np.int32]:
    """Return (X, Y, Z) how often the closed triangles `corners` (F, 3, 3) wind around the centre of each cell of a
    grid: 0 outside, 1 inside a piece that is drawn counter-clockwise seen from outside.

    Args:
        low: (3,) the grid's corner of least coordinates.
        step: The edge of a cell.
        shape: The number of cells along x, y and z.
    """
    crossings = np.zeros((*shape[:2], shape[2] + 1), np.int32)
    for start in range(0, len(corners), FACES_AT_ONCE):
        cells = (corners[start : start + FACES_AT_ONCE] - low) / step - 0.5  # a cell's centre is at whole numbers
        cells[..., :2] += ASIDE
        first = np.maximum(np.ceil(cells[..., :2].min(1)), 0).astype(np.int64)
        last = np.minimum(np.floor(cells[..., :2].max(1)), np.array(shape[:2]) - 1).astype(np.int64)
        counts = np.maximum(last - first + 1, 0)
        columns = counts.prod(1)
        face = np.repeat(np.arange(len(cells)), columns)
        number = np.arange(len(face)) - np.repeat(np.cumsum(columns) - columns, columns)
        column = first[face] + np.stack(np.divmod(number, np.maximum(counts[face, 1], 1)), -1)
        sign, height = _crossed(cells[face], column)
        above = np.clip(np.ceil(height), 0, shape[2]).astype(np.int64)
        np.add.at(crossings, (column[:, 0], column[:, 1], above), sign)
    return -np.cumsum(crossings, axis=2, dtype=np.int32)[..., :-1]


def _crossed(corners: Float, column: NDArray[np.integer]) -> tuple[NDArray[np.int32], Float]:
    """Return (N,) 1 where the column (N, 2) crosses the triangle (N, 3, 3) out of its front, -1 out of its back, 0
    beside it; and (N,) the height there."""
    apart = corners[..., :2] - column[:, None]
    ahead = np.roll(apart, -1, axis=1)
    areas = apart[..., 0] * ahead[..., 1] - apart[..., 1] * ahead[..., 0]  # opposite to the corner before each
    within = (areas > 0).all(1) | (areas < 0).all(1)
    whole = areas.sum(1)
    weights = np.roll(areas, -1, axis=1) / np.where(whole == 0, 1, whole)[:, None]
    return np.where(within, np.sign(whole), 0).astype(np.int32), (weights * corners[..., 2]).sum(1)

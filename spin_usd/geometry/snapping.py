"""Where a picked point snaps to: the surface itself, or a vertex, an edge's midpoint or the centre of its facet."""

from collections.abc import Mapping
from enum import StrEnum

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.facet import Facet
from spin_usd.geometry.triangles import normals


class Snap(StrEnum):
    """Snapping of a picked point to features of the picked facet."""

    SURFACE = "surface"
    VERTEX = "vertex"
    EDGE = "edge midpoint"
    FACE = "face centre"


def snap_places(met: Float, facet: Facet) -> Mapping[Snap, Float]:
    """Return where the point `met` (3,) on the `facet` goes by each way to snap: of several, the nearest."""
    return {
        Snap.SURFACE: met,
        Snap.VERTEX: _nearest(facet.vertices, met),
        Snap.EDGE: _nearest(facet.edge_midpoints, met),
        Snap.FACE: facet.centre,
    }


def met_at(origin: Float, directions: Float, corners: Float) -> Float:
    """Return (...) how far along the unit `directions` (..., 3) the lines from `origin` (3,) meet the planes of the
    triangles `corners` (..., 3, 3)."""
    across = normals(corners)
    distance: Float = ((corners[..., 0, :] - origin) * across).sum(-1) / (directions * across).sum(-1)
    return distance


def _nearest(points: Float, to: Float) -> Float:
    """Return the one of the `points` (N, 3) that is nearest to the point `to` (3,); that point itself without any."""
    if not len(points):
        return to
    nearest: Float = points[int(np.argmin(np.linalg.norm(points - to, axis=1)))]
    return nearest

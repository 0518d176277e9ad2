"""UsdGeom.NurbsPatch as triangles: points on the surface, and its true normals.

Source: L. Piegl and W. Tiller, "The NURBS Book" (1997), whose terms the schema uses; control points run along u
first, and are not multiplied by their weights.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.triangles import Int, Triangles, face_normals, unit
from spin_usd.stage.usd.values import array, read

CHORD = 1e-4  # of the patch's extent: how far the middle between two samples may be from the surface
STEPS = (2, 4, 8, 16, 32, 64)  # between two knots; the fewest that stay within CHORD
TOUCHING = 1e-12  # of the longest product of derivatives: below this there is no normal, as at a pole


def read_nurbs_patch(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    """Read the patch in its own axes. Raises StageError for arrays that are not a valid patch, UnsupportedError for one
    with trim curves."""
    patch = UsdGeom.NurbsPatch(prim)
    if len(array(patch.GetTrimCurveCountsAttr(), time, np.int64)):
        raise UnsupportedError("is trimmed by curves", where=prim.GetPath(), do="convert it to a Mesh")
    u, v = _axis(patch, "u", time), _axis(patch, "v", time)
    net = _net(patch, u, v, time)
    extent = float(np.linalg.norm(np.ptp(net[..., :3] / net[..., 3:], axis=(0, 1))))
    for steps in STEPS:
        points, normals = _surface(net, u, v, steps)
        if max(_bulge(points), _bulge(points.swapaxes(0, 1))) <= CHORD * extent:
            break
    return _triangles(points, normals)


@dataclass(frozen=True, kw_only=True, eq=False)
class Axis:
    """One of a patch's two parameters: its knots, its polynomials' order, and the range (2,) that the patch covers."""

    knots: Float
    order: int
    range: Float

    @property
    def count(self) -> int:
        """The number of control points."""
        return len(self.knots) - self.order

    def bases(self, steps: int) -> tuple[Float, Float]:
        """Evaluate each control point's weight (N, count) at `steps` samples between two knots, and its derivative."""
        from scipy.interpolate import BSpline  # not above: scipy is slow to load, and few need it

        inner = self.knots[(self.knots > self.range[0]) & (self.knots < self.range[1])]
        ends = np.unique([self.range[0], *inner, self.range[1]])
        at = np.unique(np.concatenate([np.linspace(*pair, steps + 1) for pair in pairwise(ends)]))
        spline = BSpline(self.knots, np.eye(self.count), self.order - 1)
        return spline(at), spline.derivative()(at)


def _axis(patch: UsdGeom.NurbsPatch, name: str, time: Usd.TimeCode) -> Axis:
    prim = patch.GetPrim()
    knots = array(prim.GetAttribute(f"{name}Knots"), time, np.float64)
    count, order = (int(read(prim.GetAttribute(f"{name}{what}"), time) or 0) for what in ("VertexCount", "Order"))
    fits = order >= 2 and count >= order and len(knots) == count + order
    if not fits or (np.diff(knots) < 0).any() or not knots[order - 1] < knots[count]:
        found = f"has {count} points, order {order} and {len(knots)} knots along {name}, which is not a valid patch"
        raise StageError(found, where=prim.GetPath(), do="fix them: as many knots as points and order, ascending")
    whole = np.array([knots[order - 1], knots[count]])
    authored = read(prim.GetAttribute(f"{name}Range"), time)
    low, high = np.clip(np.array(authored if authored is not None else whole, np.float64), *whole)
    return Axis(knots=knots, order=order, range=np.array([low, high]) if low < high else whole)


def _net(patch: UsdGeom.NurbsPatch, u: Axis, v: Axis, time: Usd.TimeCode) -> Float:
    """Read the control points times their weights, and the weights, (v, u, 4)."""
    points = array(patch.GetPointsAttr(), time, np.float64).reshape(-1, 3)
    weights = array(patch.GetPointWeightsAttr(), time, np.float64)
    weights = weights if len(weights) else np.ones(len(points))
    if len(points) != u.count * v.count or len(weights) != len(points):
        found = f"has {len(points)} points and {len(weights)} weights, expected {u.count} x {v.count}"
        raise StageError(found, where=patch.GetPath(), do="fix them")
    if not (weights > 0).all():
        raise StageError("holds weights that are not positive", where=patch.GetPath(), do="fix them")
    return np.column_stack([points * weights[:, None], weights]).reshape(v.count, u.count, 4)


def _surface(net: Float, u: Axis, v: Axis, steps: int) -> tuple[Float, Float]:
    """Evaluate points and normals (V, U, 3); normals are 0 if undefined."""
    (bu, du), (bv, dv) = u.bases(steps), v.bases(steps)
    whole, along_u, along_v = (
        np.einsum("vi,uj,ijc->vuc", of_v, of_u, net) for of_v, of_u in ((bv, bu), (bv, du), (dv, bu))
    )
    points = whole[..., :3] / whole[..., 3:]
    tangents = [(each[..., :3] - points * each[..., 3:]) / whole[..., 3:] for each in (along_u, along_v)]
    normals = np.cross(*tangents)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return points, np.where(length > TOUCHING * length.max(), normals, 0)


def _bulge(points: Float) -> float:
    """Return the largest distance of an odd row of (2 N + 1, M, 3) from the middle between its neighbours."""
    middle = (points[:-2:2] + points[2::2]) / 2
    return float(np.linalg.norm(points[1::2] - middle, axis=-1).max())


def _triangles(points: Float, normals: Float) -> Triangles:
    rows, columns = points.shape[:2]
    at = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], -1).reshape(-1, 4)
    corners: Int = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    flat = np.repeat(face_normals(points.reshape(-1, 3), corners)[:, None], 3, axis=1)
    own = normals.reshape(-1, 3)[corners]
    there: NDArray[np.bool_] = (own != 0).any(-1, keepdims=True)
    return Triangles(
        points=points.reshape(-1, 3),
        corners=corners,
        normals=np.where(there, unit(own), flat),
        source=np.zeros(len(corners), np.int64),
    ).with_area()

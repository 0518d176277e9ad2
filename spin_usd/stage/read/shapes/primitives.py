"""USD's own shapes as triangles: points on the true surface, exact normals where it is round."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.deformation import Deformation
from spin_usd.stage.read.shapes.nurbs import read_nurbs_patch
from spin_usd.stage.read.shapes.primvars import FoundPrimvar
from spin_usd.stage.read.shapes.revolution import arc, disc, revolve, side
from spin_usd.stage.read.shapes.triangles import Int, Triangles, face_normals
from spin_usd.stage.usd.values import read

# Which axes replace (x, y, z) of a shape along z, so that the frame stays right-handed.
AXES = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}


def read_gprim(
    prim: Usd.Prim, time: Usd.TimeCode, primvars: Sequence[FoundPrimvar] = (), deformation: Deformation | None = None
) -> Triangles:
    """Read triangles of a shape in its own axes, stage units, with `primvars` at their corners; moved by its skeleton.

    Raises StageError for a size of zero or less, UnsupportedError for a primvar that varies: USD neither defines the
    points and faces of its shapes nor gives them texture coordinates.
    """
    triangles = SHAPES[str(prim.GetTypeName())](prim, time)
    for primvar in primvars:
        if not primvar.is_constant:
            found = f"varies over the {prim.GetTypeName()} {prim.GetPath()}, whose points USD does not number"
            raise UnsupportedError(found, where=primvar.where, do="give it one value, or make the shape a Mesh")
    values = {p.name: np.broadcast_to(p.elements[0], (*triangles.corners.shape, p.values.shape[1])) for p in primvars}
    triangles = replace(triangles, primvars=values)
    if read(UsdGeom.Gprim(prim).GetOrientationAttr()) == UsdGeom.Tokens.leftHanded:
        triangles = replace(triangles.flipped(), normals=-triangles.flipped().normals)
    return triangles.transformed(deformation.matrix(), prim.GetPath()) if deformation else triangles


def _cube(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    h = _size(prim, "size", time) / 2
    x, y, z = np.meshgrid([-h, h], [-h, h], [-h, h], indexing="ij")
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return _flat(points, quads)


def _plane(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    w, length = _size(prim, "width", time) / 2, _size(prim, "length", time) / 2
    # Width runs along x, length along y; along z and y for axis X, along x and z for axis Y.
    across, along = {"X": (2, 1), "Y": (0, 2), "Z": (0, 1)}[_axis(prim)]
    points = np.zeros((4, 3))
    points[:, across], points[:, along] = [-w, w, w, -w], [-length, -length, length, length]
    quad = [0, 1, 2, 3] if _axis(prim) == "Z" else [0, 3, 2, 1]
    return _flat(points, np.array([quad]))


def _sphere(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    return revolve([arc(_size(prim, "radius", time), 0.0, -np.pi / 2, np.pi / 2)])


def _cylinder(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    r, h = _size(prim, "radius", time), _size(prim, "height", time) / 2
    return _along(prim, revolve([disc(r, -h, -1), side(r, -h, r, h), disc(r, h, 1)]))


def _tapered_cylinder(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    h = _size(prim, "height", time) / 2
    low, high = _radii(prim, time)
    return _along(prim, revolve([disc(low, -h, -1), side(low, -h, high, h), disc(high, h, 1)]))


def _cone(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    r, h = _size(prim, "radius", time), _size(prim, "height", time) / 2
    return _along(prim, revolve([disc(r, -h, -1), side(r, -h, 0.0, h)]))


def _capsule(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    r, h = _size(prim, "radius", time), _size(prim, "height", time, zero=True) / 2
    return _along(prim, revolve([arc(r, -h, -np.pi / 2, 0.0), side(r, -h, r, h), arc(r, h, 0.0, np.pi / 2)]))


def _tapered_capsule(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    """Read a capsule whose radii are those of the circles at the spine's ends, where spheres meet the cone between them
    without an edge (as USD's extent has it): a sphere's own radius is larger, and its centre shifted along the
    spine."""
    h = _size(prim, "height", time, zero=True) / 2
    low, high = _radii(prim, time)
    if h == 0 and low != high:
        raise StageError("its height is 0 and its radii differ", where=prim.GetPath(), do="give it a height")
    cone = side(low, -h, high, h)
    lean = float(np.arctan2(low - high, 2 * h))
    grow, shift = 1 / np.cos(lean), np.tan(lean)
    bottom = arc(low * grow, -h - low * shift, -np.pi / 2, lean)
    top = arc(high * grow, h - high * shift, lean, np.pi / 2)
    bottom[0][-1], top[0][0] = cone[0]  # to the last bit, so that the surface closes
    return _along(prim, revolve([bottom, cone, top]))


SHAPES: dict[str, Callable[[Usd.Prim, Usd.TimeCode], Triangles]] = {
    "Cube": _cube,
    "Plane": _plane,
    "Sphere": _sphere,
    "Cylinder": _cylinder,
    "Cylinder_1": _tapered_cylinder,
    "Cone": _cone,
    "Capsule": _capsule,
    "Capsule_1": _tapered_capsule,
    "NurbsPatch": read_nurbs_patch,
}


def _flat(points: Float, quads: Int) -> Triangles:
    corners = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    normals = np.repeat(face_normals(points, corners)[:, None], 3, axis=1)
    return Triangles(points=points, corners=corners, normals=normals, source=np.zeros(len(corners), np.int64))


def _along(prim: Usd.Prim, triangles: Triangles) -> Triangles:
    """Turn a shape made along z to the prim's own axis."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3)[AXES[_axis(prim)]].T
    return triangles.transformed(matrix, prim.GetPath())


def _axis(prim: Usd.Prim) -> str:
    axis = str(read(prim.GetAttribute("axis")))
    if axis not in AXES:
        raise StageError(f"its axis is '{axis}'", where=prim.GetPath(), do="set it to X, Y or Z")
    return axis


def _radii(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[float, float]:
    low, high = (_size(prim, name, time, zero=True) for name in ("radiusBottom", "radiusTop"))
    if low == high == 0:
        raise StageError("both its radii are 0", where=prim.GetPath(), do="give it a radius")
    return low, high


def _size(prim: Usd.Prim, name: str, time: Usd.TimeCode, *, zero: bool = False) -> float:
    value = float(read(prim.GetAttribute(name), time))
    if value < 0 or (value == 0 and not zero):
        raise StageError(f"its {name} is {value:g}", where=prim.GetPath(), do="make it positive")
    return value

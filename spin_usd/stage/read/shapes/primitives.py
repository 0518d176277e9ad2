"""USD's own shapes as triangles: points on the true surface, exact normals where it is round."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.nurbs import read_nurbs_patch
from spin_usd.stage.read.shapes.primvars import FoundPrimvar
from spin_usd.stage.read.shapes.skeletons import Deformation
from spin_usd.stage.read.shapes.triangles import Int, Triangles, face_normals, unit
from spin_usd.stage.usd.values import read

# Which axes replace (x, y, z) of a shape along z, so that the frame stays right-handed.
AXES = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}
SEGMENTS = 224
"""The corners of a round section: a chord then stays within 1e-4 of the radius (1 - cos(pi / 224) = 9.8e-5).

That is one pixel in 10,000 across a radius. Between the corners of a sphere, which curves both ways, it is twice
that."""
Profile = list[tuple[Float, Float]]
"""Sections of an outline from bottom to top: points (K, 2) and normals (K, 2) as (distance from the axis, height)."""


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
    """Read a capsule whose radii belong to the circles at the spine's ends, where spheres meet the cone between them
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


def revolve(profile: Profile) -> Triangles:
    """Make a surface of revolution: rotate an outline's sections about z.

    They meet at sharp edges; points on the axis are merged.
    """
    angle = np.arange(SEGMENTS) * (2 * np.pi / SEGMENTS)
    ring = np.stack([np.cos(angle), np.sin(angle)], -1)
    points: list[Float] = []
    corners, normals = [], []
    base = 0
    for outline, directions in profile:
        points.append(_rotated(outline, ring).reshape(-1, 3))
        rotated = _rotated(directions, ring)
        for k, (low, high) in enumerate(pairwise(base + SEGMENTS * np.arange(len(outline)))):
            i, j = np.arange(SEGMENTS), (np.arange(SEGMENTS) + 1) % SEGMENTS
            corners += [np.stack([low + i, low + j, high + j], -1), np.stack([low + i, high + j, high + i], -1)]
            normals += [
                np.stack([rotated[k, i], rotated[k, j], rotated[k + 1, j]], 1),
                np.stack([rotated[k, i], rotated[k + 1, j], rotated[k + 1, i]], 1),
            ]
        base += SEGMENTS * len(outline)
    flat = np.concatenate(corners)
    return _welded(np.concatenate(points), flat, np.concatenate(normals))


def _welded(points: Float, corners: Int, normals: Float) -> Triangles:
    """Merge coincident points and drop triangles without area, so that the surface is closed."""
    unique, place = np.unique(points, axis=0, return_inverse=True)
    triangles = Triangles(
        points=unique,
        corners=place.reshape(-1)[corners].astype(np.int64),
        normals=unit(normals),
        source=np.zeros(len(corners), np.int64),
    )
    return triangles.with_area()


def _rotated(outline: Float, ring: Float) -> Float:
    """Rotate (distance, height) (K, 2) to points (K, SEGMENTS, 3); exactly on the axis where the distance is 0."""
    k, s = len(outline), len(ring)
    height = np.broadcast_to(outline[:, None, 1:], (k, s, 1))
    return np.concatenate([outline[:, None, :1] * ring + 0.0, height], -1)


def arc(radius: float, height: float, start: float, end: float) -> tuple[Float, Float]:
    """Make the section of a circle around (0, height) from the angle `start` to `end`, radians from the equator."""
    steps = int(np.ceil(SEGMENTS * (end - start) / (2 * np.pi) - 1e-9))
    angle = np.linspace(start, end, steps + 1)
    normal = np.stack([np.where(np.isclose(abs(angle), np.pi / 2), 0, np.cos(angle)), np.sin(angle)], -1)
    return radius * normal + [0, height], normal


def side(r0: float, z0: float, r1: float, z1: float) -> tuple[Float, Float]:
    """Make the straight section from (r0, z0) to (r1, z1)."""
    normal = unit(np.array([z1 - z0, r0 - r1, 0.0]))[:2]
    return np.array([[r0, z0], [r1, z1]]), np.array([normal, normal])


def disc(radius: float, height: float, up: int) -> tuple[Float, Float]:
    """Make the section of a flat disc that faces up (1) or down (-1)."""
    outline = np.array([[0.0, height], [radius, height]])
    return (outline if up < 0 else outline[::-1]), np.array([[0.0, up], [0.0, up]])

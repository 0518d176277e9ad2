"""Poses of prims: transforms in double precision, checked for mistakes that USD does not report."""

from dataclasses import dataclass

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from spin_usd.basics.arrays import Float, finite
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.rotation import off_rotation
from spin_usd.geometry.transform import Transform
from spin_usd.stage.usd.conversion import quaternions
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.values import read, read_all

# USD reads a quaternion that is not of unit length as another rotation; 1e-6 in the norm is 2e-6 rad at most.
NORM_TOLERANCE = 1e-6
ROUNDED_TOLERANCE = 1e-2  # inside the target: half precision, or printed with two decimals
HALF_NORM_TOLERANCE = 2e-3  # four halves of 11 bits each
# The rounding of an accepted quaternion, or of a matrix that passed through float32, does not count as shear.
SHEAR_TOLERANCE = 1e-5
ORTHONORMAL = 1e-12  # a matrix this close to a rotation is used unchanged; 30 roundings stay below
UNIT_SCALE_TOLERANCE = 1e-9  # a product of a few rotations is rounded by less

SAMPLED, EDITED = ":sampled", ":edited"
"""Suffixes of transform operations that spin_usd writes over a stage's own, so that they never collide with those: in
an augmentation, and in a simulator."""

_T, _OP = Sdf.ValueTypeNames, UsdGeom.XformOp
NUMBER, VECTOR = (_T.Double, _T.Float, _T.Half), (_T.Double3, _T.Float3, _T.Half3)
OP_TYPES = {
    **dict.fromkeys((_OP.TypeTranslate, _OP.TypeScale), VECTOR),
    **dict.fromkeys((_OP.TypeTranslateX, _OP.TypeTranslateY, _OP.TypeTranslateZ), NUMBER),
    **dict.fromkeys((_OP.TypeScaleX, _OP.TypeScaleY, _OP.TypeScaleZ), NUMBER),
    **dict.fromkeys((_OP.TypeRotateX, _OP.TypeRotateY, _OP.TypeRotateZ), NUMBER),
    _OP.TypeOrient: (_T.Quatd, _T.Quatf, _T.Quath),
    _OP.TypeTransform: (_T.Matrix4d,),
}
"""The types of the attributes of transform operations; of those not here, rotations about three axes, VECTOR."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Placement:
    """A prim's axes in the world: `transform` in metres without scale, and the scale factor that was removed."""

    transform: Transform
    scale: float


def placement(matrix: Gf.Matrix4d, *, frame: str, metres: float, where: object) -> Placement:
    """Decompose a local-to-world `matrix` in stage units of `metres` each. Raises StageError for shear, unequal scale
    factors or a mirror."""
    m = np.array(matrix)
    linear = m[:3, :3].T
    if not np.isfinite(m).all():
        raise StageError("its transform is not finite", where=where, do="fix the numbers of its xformOps")
    off, right_handed = off_rotation(linear)
    if off < ORTHONORMAL and right_handed:
        place = finite(m[3, :3] * metres, (3,), "translation")
        transform = Transform.unchecked(to="world", of=frame, rotation=linear, translation=place)
        return Placement(transform=transform, scale=1.0)
    u, sizes, vt = np.linalg.svd(linear)
    if sizes[2] <= 0 or np.linalg.det(linear) <= 0:
        raise StageError("its transform is mirrored or flat", where=where, do="give it a plain rotation")
    if sizes[0] - sizes[2] > SHEAR_TOLERANCE * sizes[0]:
        found = f"its transform shears or scales unequally (by {sizes[0] / sizes[2]:.6g})"
        raise StageError(found, where=where, do="scale the prims below it instead")
    scale = float(np.cbrt(sizes.prod()))
    scale = 1.0 if abs(scale - 1) < UNIT_SCALE_TOLERANCE else scale
    transform = Transform(to="world", of=frame, rotation=u @ vt, translation=m[3, :3] * metres)
    return Placement(transform=transform, scale=scale)


def between(T_world_a: Transform, T_world_b: Transform) -> Transform:
    """Compute T_a_b. The origins are subtracted first: in an orbit both are far from the stage's, but near to each
    other."""
    inverse = T_world_a.rotation.T
    return Transform.unchecked(
        to=T_world_a.of,
        of=T_world_b.of,
        rotation=inverse @ T_world_b.rotation,
        translation=inverse @ (T_world_b.translation - T_world_a.translation),
    )


def nearest_ancestor(first: Usd.Prim, second: Usd.Prim) -> Usd.Prim:
    """Find the nearest ancestor of both prims with which both move: the pseudo-root where one resets its transform
    stack.

    An ancestor that orbits the Sun, 1.5e11 m from the stage's origin, where doubles are 3e-5 m apart, does not move the
    two relative to each other. So only their poses below that ancestor are used.
    """
    above = first.GetStage().GetPrimAtPath(first.GetPath().GetCommonPrefix(second.GetPath()))
    above = above.GetParent() if above in (first, second) else above
    cache = UsdGeom.XformCache()
    free = any(cache.ComputeRelativeTransform(prim, above)[1] for prim in (first, second))
    return first.GetStage().GetPseudoRoot() if free else above


def placement_below(above: Usd.Prim, prim: Usd.Prim, world: UsdGeom.XformCache, *, frame: str) -> Placement:
    """Compute the `placement` of `prim` in the axes and the units of its ancestor `above`."""
    matrix, _ = world.ComputeRelativeTransform(prim, above)
    return placement(matrix, frame=frame, metres=1.0, where=prim.GetPath())


def check_chain(prim: Usd.Prim) -> None:
    """Apply `check_ops` to a prim and all its ancestors."""
    while prim and not prim.IsPseudoRoot():
        check_ops(prim)
        prim = prim.GetParent()


def check_ops(prim: Usd.Prim) -> None:
    """Raise StageError for a listed transform operation that does not exist, or an orientation that USD misreads."""
    if UsdGeom.Xformable(prim):
        _check_order(prim)
        for op in UsdGeom.Xformable(prim).GetOrderedXformOps():
            _check_type(op)
            if op.GetOpType() == UsdGeom.XformOp.TypeOrient:
                _check_orient(op, prim)


def op_types(op: UsdGeom.XformOp) -> tuple[Sdf.ValueTypeName, ...]:
    """Return the types that the attribute of a transform operation may have."""
    return OP_TYPES.get(op.GetOpType(), VECTOR)


def _check_type(op: UsdGeom.XformOp) -> None:
    """Raise StageError for an operation whose attribute is not of the operation's type."""
    attribute, allowed = op.GetAttr(), op_types(op)
    kind = attribute.GetTypeName()
    if not kind or not any(kind.type == each.type for each in allowed):
        found = f"is a {kind}" if kind else "is of a type unknown to USD"
        raise StageError(found, where=attribute.GetPath(), do=f"make it a {' or '.join(map(str, allowed))}")


def _check_order(prim: Usd.Prim) -> None:
    xformable = UsdGeom.Xformable(prim)
    for name in read(xformable.GetXformOpOrderAttr()) or []:
        plain = name.removeprefix("!invert!")
        if plain != "!resetXformStack!" and not prim.GetAttribute(plain):
            raise StageError(f"xformOpOrder lists {name}, which is not authored", where=prim.GetPath(), do="author it")


def _rotation(op: UsdGeom.XformOp, time: Usd.TimeCode, notes: Notes) -> Gf.Matrix4d:
    """Return the rotation, as a row-vector matrix, of an orientation whose norm is not 1. Raises StageError where
    rounding does not explain its norm."""
    off = orient_norm_error(op)
    where, value = op.GetAttr().GetPath(), read(op.GetAttr(), time)
    if off > ROUNDED_TOLERANCE or value is None:
        found = f"holds a quaternion whose norm is off 1 by {off:.3g}, which is not a rotation"
        raise StageError(found, where=where, do="normalise it")
    notes.add("orient-rounded", where, f"holds a quaternion whose norm is off 1 by {off:.2g}: it is normalised")
    matrix = Gf.Matrix4d().SetRotate(Gf.Quatd(value).GetNormalized())
    return matrix.GetInverse() if op.IsInverseOp() else matrix


def _check_orient(op: UsdGeom.XformOp, prim: Usd.Prim) -> None:
    where = f"{prim.GetPath()}.{op.GetOpName()}"
    if op.GetPrecision() == UsdGeom.XformOp.PrecisionHalf:
        raise StageError("a half-precision orientation is off by up to 0.5 degrees", where=where, do="use quatd")
    worst = orient_norm_error(op)
    if worst > NORM_TOLERANCE:
        found = f"holds a quaternion whose norm is off 1 by {worst:.3g}, which USD reads as another rotation"
        raise StageError(found, where=where, do="normalise it")


def orient_norm_error(op: UsdGeom.XformOp) -> float:
    """Return the largest error of an orientation's norms, which should be 1; infinity for NaN."""
    return norm_error(quaternions(read_all(op.GetAttr(), *op_types(op))))


def norm_error(quaternions: Float) -> float:
    """Return the largest error of the norms of `quaternions` (N, 4), which should be 1; infinity for NaN."""
    off = np.abs(np.linalg.norm(quaternions, axis=1) - 1).max(initial=0)
    return float(off) if np.isfinite(off) else float("inf")


def local_matrix(prim: Usd.Prim, time: Usd.TimeCode, notes: Notes) -> Float:
    """Compute the row-vector matrix (4, 4), prim to parent, in stage units; the identity for a prim without transform.

    Orientations that were rounded are normalised, and noted: no pose depends on them.
    """
    xformable = UsdGeom.Xformable(prim)
    if not xformable:
        return np.eye(4)
    _check_order(prim)
    if xformable.GetResetXformStack():
        found = "resets its transform stack, so it does not move with the target"
        raise UnsupportedError(found, where=prim.GetPath(), do="remove !resetXformStack!")
    ops = xformable.GetOrderedXformOps()
    for op in ops:
        _check_type(op)
    rounded = [
        op for op in ops if op.GetOpType() == UsdGeom.XformOp.TypeOrient and orient_norm_error(op) > NORM_TOLERANCE
    ]
    matrix: Float = np.array(xformable.GetLocalTransformation(time))
    if rounded:
        matrix = np.eye(4)
        for op in ops:
            matrix = np.array(_rotation(op, time, notes) if op in rounded else op.GetOpTransform(time)) @ matrix
    if not np.isfinite(matrix).all():
        raise StageError("its transform holds NaN or infinity", where=prim.GetPath(), do="fix its xformOps")
    return matrix

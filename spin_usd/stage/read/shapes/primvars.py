"""Primvars as authored on a gprim or above it, and as values at the corners of its triangles."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.triangles import Int
from spin_usd.stage.usd.shader_inputs import refuse_other_colours
from spin_usd.stage.usd.values import read_any, refuse

INTERPOLATIONS = ("constant", "uniform", "vertex", "varying", "faceVarying")
DISPLAY_COLOR = "displayColor"  # how much of the light a surface reflects


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundPrimvar:
    """A primvar as authored."""

    name: str
    values: Float
    """(V, C)"""
    indices: Int
    """(N,): the value of each element."""
    interpolation: str
    """Interpolation: constant, per face and so on."""
    where: str
    """For messages."""
    prim: Usd.Prim
    """Prim that authors it."""
    clamped: bool = False
    """Whether values above 1 were set to 1."""

    @property
    def is_constant(self) -> bool:
        """Return whether the value is the same everywhere."""
        return bool((self.values[self.indices] == self.values[self.indices[0]]).all())

    @property
    def elements(self) -> Float:
        """The values of all elements (N, C)."""
        result: Float = self.values[self.indices]
        return result

    @property
    def key(self) -> str:
        """The path at which it is authored; the same for all instances of a prototype."""
        prim = self.prim.GetPrimInPrototype() if self.prim.IsInstanceProxy() else self.prim
        return f"{prim.GetPath()}.{self.name}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Corners:
    """The elements of a mesh at the corners of its triangles."""

    positions: Int
    """(T, 3) in faceVertexIndices."""
    points: Int
    """(T, 3)"""
    faces: Int
    """(T,)"""
    counts: tuple[int, int, int]
    """Of face corners, points and faces."""

    def elements(self, interpolation: str, count: int, where: str) -> Int:
        """Return the element (T, 3) at each corner. Raises StageError where the primvar's `count` of elements is
        wrong."""
        corners, points, faces = self.counts
        choices: dict[str, tuple[int, Any]] = {
            "constant": (1, np.zeros_like(self.positions)),
            "uniform": (faces, np.repeat(self.faces[:, None], 3, axis=1)),
            "vertex": (points, self.points),
            "varying": (points, self.points),
            "faceVarying": (corners, self.positions),
        }
        check_count(interpolation, count, choices[interpolation][0], where)
        result: Int = choices[interpolation][1]
        return result


def known_interpolation(interpolation: str, where: object) -> str:
    """Return the `interpolation`. Raises StageError for an unknown one: it is metadata, which may be any text."""
    if interpolation not in INTERPOLATIONS:
        do = f"use one of {', '.join(INTERPOLATIONS)}"
        raise StageError(f"has the interpolation '{interpolation}'", where=where, do=do)
    return interpolation


def check_count(interpolation: str, count: int, needed: int, where: str) -> None:
    """Raise StageError unless the interpolation's `count` of values is as `needed`."""
    if count != needed:
        found = f"holds {count} values, {interpolation} interpolation needs {needed}"
        raise StageError(found, where=where, do="fix or remove them")


def check_elements(primvar: FoundPrimvar, mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> None:
    """Raise UnsupportedError if the number of the primvar's values does not match its interpolation."""
    attributes = {
        "uniform": mesh.GetFaceVertexCountsAttr(),
        "faceVarying": mesh.GetFaceVertexIndicesAttr(),
        **dict.fromkeys(("vertex", "varying"), mesh.GetPointsAttr()),
    }
    attribute, count = attributes.get(primvar.interpolation), len(primvar.indices)
    needed = len(read_any(attribute, time) or ()) if attribute else 1
    if count != needed:
        found = f"holds {count} values, {primvar.interpolation} interpolation needs {needed}"
        raise UnsupportedError(found, where=primvar.where)


def find_primvar(prim: Usd.Prim, name: str, channels: int, time: Usd.TimeCode) -> FoundPrimvar | None:
    """Find the primvar `name`, of `channels` numbers each, that `prim` has or inherits; None if missing.

    Raises UnsupportedError for one of another type, StageError for values that are not finite.
    """
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    value = read_any(primvar.GetAttr(), time) if primvar and primvar.HasValue() else None
    if value is None:
        return None
    where = str(primvar.GetAttr().GetPath())
    array = np.array(value)
    expected = (channels,) if channels > 1 else ()
    shape = array.shape[1:] if primvar.GetTypeName().isArray else array.shape
    if array.dtype.kind != "f" or shape != expected or primvar.GetElementSize() != 1:
        found = f"is {primvar.GetTypeName()}, and its material reads {channels} number{'s' * (channels > 1)}"
        raise UnsupportedError(found, where=where, do="give it the type that is read")
    refuse_other_colours(primvar.GetAttr(), where)
    values = array.astype(np.float64).reshape(-1, channels)
    indices = _indices(primvar, len(values), time, where)
    if not len(indices):
        return None
    above = name == DISPLAY_COLOR and bool((values > 1).any())
    return FoundPrimvar(
        name=name,
        values=np.minimum(values, 1) if above else values,
        clamped=above,
        indices=indices,
        interpolation=known_interpolation(str(primvar.GetInterpolation()), where),
        where=where,
        prim=primvar.GetAttr().GetPrim(),
    )


def _indices(primvar: UsdGeom.Primvar, count: int, time: Usd.TimeCode, where: str) -> Int:
    authored = primvar.GetIndices(time) if primvar.IsIndexed() else None
    if authored is None:
        return np.arange(count)
    indices = np.array(authored, np.int64)
    refuse((indices < 0) | (indices >= count), "indices", indices, f"there are {count} values", Sdf.Path(where))
    return indices

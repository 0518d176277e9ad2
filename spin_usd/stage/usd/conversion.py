"""All conversions between numpy and USD's own value types."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike
from pxr import Gf, Tf, Vt

from spin_usd.basics.arrays import Float
from spin_usd.basics.unique_names import UniqueNames


def vec3d(v: ArrayLike) -> Gf.Vec3d:
    """Convert three numbers (3,)."""
    return Gf.Vec3d(*(float(x) for x in np.asarray(v, np.float64)))


def quatd(q: ArrayLike) -> Gf.Quatd:
    """Convert a quaternion (4,), scalar first."""
    w, x, y, z = (float(x) for x in np.asarray(q, np.float64))
    return Gf.Quatd(w, x, y, z)


def quaternions(values: Iterable[Gf.Quatd | Gf.Quatf | Gf.Quath]) -> Float:
    """Convert USD's quaternions to an array (N, 4), scalar first."""
    doubles = [q if isinstance(q, Gf.Quatd) else Gf.Quatd(q) for q in values]
    imaginary_first = np.array(Vt.QuatdArray(doubles), np.float64).reshape(-1, 4)
    return np.roll(imaginary_first, 1, axis=1)


def vec3f_array(v: ArrayLike) -> Vt.Vec3fArray:
    """Convert an array (N, 3), rounded to float32."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(v, np.float32).reshape(-1, 3))


def vec2f_array(v: ArrayLike) -> Vt.Vec2fArray:
    """Convert an array (N, 2), rounded to float32."""
    return Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(v, np.float32).reshape(-1, 2))


def int_array(v: ArrayLike) -> Vt.IntArray:
    """Convert whole numbers (N,) to 32 bits."""
    return Vt.IntArray.FromNumpy(np.ascontiguousarray(v, np.int32))


def box(points: ArrayLike) -> Vt.Vec3fArray:
    """Compute the `extent` (2, 3) of points (N, 3), which are rounded to float32 as USD keeps them."""
    p = np.asarray(points, np.float32)
    return vec3f_array([p.min(0), p.max(0)])


def identifier(name: str) -> str:
    """Turn `name` into a prim name in ASCII; '_' replaces characters that are not allowed."""
    ascii_name = "".join(c if c.isascii() else "_" for c in name)
    return str(Tf.MakeValidIdentifier(ascii_name))


def unique_identifiers(names: list[str]) -> list[str]:
    """Turn each of `names` into a prim name, in order; a repeated name gets a number."""
    unique = UniqueNames()
    return [unique.give(identifier(name)) for name in names]

"""Properties of Blender's objects, set and read back, because Blender clamps them silently."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from mathutils import Matrix

from spin_usd.arrays import Float
from spin_usd.errors import RenderError

SINGLE_PRECISION = 1e-6  # relative rounding of a float32 property, with room for its unit conversion
FLOAT32 = 2.0**-23  # relative rounding of a matrix that Blender stores


def assign(owner: Any, values: Mapping[str, Any]) -> None:
    """Set properties and read them back; RenderError names the first that Blender did not take."""
    for name, value in values.items():
        setattr(owner, name, value)
        got = getattr(owner, name)
        if not _same(got, value):
            raise RenderError(f"Blender set {type(owner).__name__}.{name} to {got!r} where {value!r} was wanted")


def assign_matrix(owner: Any, matrix: Float) -> None:
    """Place an object in its parent's axes by `matrix` (4, 4), metres; RenderError where Blender changes it.

    The matrix goes through the parent's inverse, which keeps each entry to float32's rounding; through a quaternion it
    was up to 17 times less exact.
    """
    owner.matrix_parent_inverse = Matrix(matrix)
    if not np.allclose(np.array(owner.matrix_parent_inverse), matrix, rtol=FLOAT32, atol=FLOAT32):
        raise RenderError(f"Blender changed the place of the object {owner.name!r}")


def _same(got: Any, want: Any) -> bool:
    if isinstance(want, (str, bool, int)):
        return bool(got == want)
    return bool(np.allclose(np.asarray(got), np.asarray(want), rtol=SINGLE_PRECISION, atol=1e-30))

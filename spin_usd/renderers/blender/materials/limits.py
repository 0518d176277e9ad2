"""Limits of materials: numbers beyond them are refused by name, because Blender would clamp them silently."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.scene.derived.lookup import bounds, extremes
from spin_usd.scene.material import LIMITS, Material
from spin_usd.scene.shape import Shape
from spin_usd.scene.texture import Primvar, Texture


def check_material(material: Material, mesh: Shape, faces: NDArray[np.bool_], inputs: Iterable[str] = LIMITS) -> None:
    """Raise UnsupportedError, with the material's path, where one of its `inputs` cannot be rendered as it is meant, or
    reads a primvar that `mesh` lacks; `faces` (F,) says where the mesh shows the material."""
    for name in inputs:
        value = getattr(material, name)
        if value is not None:
            _check(value, name, material.path, mesh, faces)
        if name == "normal" and value not in (None, (0, 0, 1)):
            _primvar(mesh, material.tangent_primvar, 2, name, material.path)


def _check(value: Any, name: str, path: str, mesh: Shape, faces: NDArray[np.bool_]) -> None:
    limits = LIMITS[name]
    size, given = limits.size, limits.size
    if isinstance(value, Primvar):
        numbers = _primvar(mesh, value.name, size, limits.name, path)[faces]
        if not numbers.size:
            return
    elif isinstance(value, Texture):
        if value.coordinates.primvar is not None:
            _primvar(mesh, value.coordinates.primvar, 2, limits.name, path)
        numbers = bounds(value)
        if not limits.low <= numbers.min() <= numbers.max() <= limits.high:
            numbers = extremes(value)
        given = numbers.shape[1]
    else:
        numbers = np.asarray(value, np.float64)
    if given != size:
        found = f"its {limits.name} takes {size} numbers, its texture gives {given}"
        raise UnsupportedError(found, where=path, do="use another output of the texture")
    if not (np.isfinite(numbers).all() and limits.low <= numbers.min() and numbers.max() <= limits.high):
        found = f"its {limits.name} lies between {numbers.min():g} and {numbers.max():g}"
        raise UnsupportedError(found, where=path, do=f"keep it finite and between {limits.low:g} and {limits.high:g}")


def _primvar(mesh: Shape, name: str, size: int, used_by: str, path: str) -> Any:
    """Return the values of the primvar; UnsupportedError unless the mesh has it with `size` components."""
    if name not in mesh.primvars:
        raise UnsupportedError(
            f"its {used_by} reads the primvar {name}, which its mesh lacks", where=path, do="author it"
        )
    values = mesh.primvars[name]
    if values.shape[2] != size:
        found = f"its {used_by} reads the primvar {name} of {values.shape[2]} components, expected {size}"
        raise UnsupportedError(found, where=path, do="give the primvar as many")
    return values

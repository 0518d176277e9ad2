"""What a surface can be made of: refused by name, because Blender would clamp it silently."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.scene.lookup import CHANNELS
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.texture import Primvar, Texture

ROUNDING = 1e-6  # of float32, which may take a share just above 1
INFINITY = float("inf")
LIMITS = {
    "diffuse_color": (0, 1 + ROUNDING, 3),  # more would reflect more than arrives
    "specular_color": (0, 1 + ROUNDING, 3),
    "emissive_color": (0, INFINITY, 3),
    "metallic": (0, 1 + ROUNDING, 1),
    "roughness": (0, 1 + ROUNDING, 1),
    "clearcoat": (0, 1 + ROUNDING, 1),
    "clearcoat_roughness": (0, 1 + ROUNDING, 1),
    "opacity": (0, 1 + ROUNDING, 1),
    "ior": (1, INFINITY, 1),
    "normal": (-INFINITY, INFINITY, 3),
}
"""Lowest and highest value of each input, and how many numbers it has."""


def check_material(material: Material, mesh: Mesh, faces: NDArray[np.bool_], inputs: Iterable[str] = LIMITS) -> None:
    """Raise UnsupportedError, with the material's path, where one of its `inputs` cannot be drawn as it is meant, or
    reads a primvar that `mesh` lacks; `faces` (F,) says where the mesh shows the material."""
    for name in inputs:
        value = getattr(material, name)
        if value is not None:
            _check(value, name, material.path, mesh, faces)
        if name == "normal" and value not in (None, (0, 0, 1)):
            _primvar(mesh, tangent_primvar(material), 2, name, material.path)


def tangent_primvar(material: Material) -> str:
    """The 2-D primvar along which a material's normals are tilted: their texture's own, else USD's usual `st`."""
    texture = material.normal
    return (isinstance(texture, Texture) and texture.coordinates.primvar) or "st"


def _check(value: Any, name: str, path: str, mesh: Mesh, faces: NDArray[np.bool_]) -> None:
    low, high, size = LIMITS[name]
    given = size
    if isinstance(value, Primvar):
        numbers = _primvar(mesh, value.name, size, name, path)[faces]
        if not numbers.size:
            return
    elif isinstance(value, Texture):
        if value.coordinates.primvar is not None:
            _primvar(mesh, value.coordinates.primvar, 2, name, path)
        numbers = _texture_extremes(value)
        given = 3 if value.output == "rgb" else 1
    else:
        numbers = np.asarray(value, np.float64)
    if given != size:
        raise UnsupportedError(f"{name} takes {size} numbers, its texture gives {given}", where=path)
    if not (np.isfinite(numbers).all() and low <= numbers.min() and numbers.max() <= high):
        found = f"{name} lies between {numbers.min():g} and {numbers.max():g}"
        raise UnsupportedError(found, where=path, do=f"keep it finite and between {low:g} and {high:g}")


def _primvar(mesh: Mesh, name: str, size: int, used_by: str, path: str) -> Any:
    """Its values; UnsupportedError unless the mesh has it with `size` components."""
    if name not in mesh.primvars:
        raise UnsupportedError(f"{used_by} reads the primvar {name}, which its mesh lacks", where=path, do="author it")
    values = mesh.primvars[name]
    if values.shape[2] != size:
        found = f"{used_by} reads the primvar {name} of {values.shape[2]} components, expected {size}"
        raise UnsupportedError(found, where=path)
    return values


def _texture_extremes(texture: Texture) -> Any:
    """Lowest and highest value of each channel of a texture; bilinear look-up goes no further."""
    channels = CHANNELS[texture.output]
    texels = texture.image.pixels[..., channels].reshape(-1, channels.stop - channels.start)
    extremes = np.stack([texels.min(0), texels.max(0)]).astype(np.float64)
    if "black" in texture.wrap:
        extremes = np.concatenate([extremes, np.zeros((1, extremes.shape[1]))])
    return extremes * np.array(texture.scale)[channels] + np.array(texture.bias)[channels]

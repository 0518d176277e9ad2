"""Values at points of the surface: constants, textures and primvars.

The shading of both renderers must agree with them.
"""

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.scene.derived.faces import materials_of, primvar_of
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.target import Target
from spin_usd.scene.texture import OUTPUTS, Color, Coordinates, Image, Primvar, Texture, Tiles

CHANNELS = {"rgb": slice(0, 3), **{name: slice(i, i + 1) for i, name in enumerate(OUTPUTS[1:])}}


def material_values(target: Target, name: str, face: NDArray[np.int32], weights: Float) -> Float:
    """Return (N, C) of the materials' input `name` at the points with barycentric `weights` (N, 3) of the faces
    (N,)."""
    material = materials_of(target.mesh, face)
    size = np.size(getattr(Material(path=""), name))
    result = np.empty((len(face), size))
    for index in np.unique(material):
        of = np.flatnonzero(material == index)
        result[of] = values_at(getattr(target.materials[index], name), target.mesh, face[of], weights[of])
    return result


def is_there(target: Target, face: NDArray[np.int32], weights: Float) -> NDArray[np.bool_]:
    """Return (N,) whether the surface exists: False where its opacity is below its material's threshold."""
    threshold = np.array([m.opacity_threshold for m in target.materials])[materials_of(target.mesh, face)]
    there = np.ones(len(face), bool)
    cut = np.flatnonzero(threshold > 0)
    if len(cut):
        there[cut] = material_values(target, "opacity", face[cut], weights[cut])[:, 0] >= threshold[cut]
    return there


def values_at(value: float | Color | Texture | Primvar, mesh: Mesh, face: NDArray[np.int32], weights: Float) -> Float:
    """Return (N, C) of `value` at the points with barycentric `weights` (N, 3) of the faces (N,); C is 1 or 3, a
    primvar's its own."""
    if isinstance(value, Primvar):
        return interpolated(mesh, value.name, face, weights)
    if isinstance(value, Texture):
        return look_up(value, coordinates_at(value.coordinates, mesh, face, weights))
    constant: Float = np.broadcast_to(np.atleast_1d(np.asarray(value, np.float64)), (len(face), np.size(value)))
    return constant


def interpolated(mesh: Mesh, name: str, face: NDArray[np.int32], weights: Float) -> Float:
    """Return (N, C) of the primvar `name`."""
    result: Float = np.einsum("nk,nkc->nc", weights, primvar_of(mesh, name, face).astype(np.float64))
    return result


def coordinates_at(coordinates: Coordinates, mesh: Mesh, face: NDArray[np.int32], weights: Float) -> Float:
    """Return (N, 2) places on an image."""
    if coordinates.primvar is None:
        st: Float = np.broadcast_to(np.array(coordinates.constant, np.float64), (len(face), 2))
    else:
        st = interpolated(mesh, coordinates.primvar, face, weights)
    return placed(coordinates, st)


def placed(coordinates: Coordinates, st: Float) -> Float:
    """`st` (N, 2) moved by the coordinates' matrix."""
    matrix = np.array(coordinates.matrix).reshape(2, 3)
    moved: Float = st @ matrix[:, :2].T + matrix[:, 2]
    return moved


def look_up(texture: Texture, st: Float) -> Float:
    """Return (N, 1 or 3) of the texture at `st` (N, 2), already placed: bilinear between the centres of its texels."""
    image, channels = texture.image, CHANNELS[texture.output]
    found = (
        _texels(image, texture.wrap, st, channels) if isinstance(image, Image) else _tile_texels(image, st, channels)
    )
    return np.asarray(found * np.array(texture.scale)[channels] + np.array(texture.bias)[channels])


def _tile_texels(tiles: Tiles, st: Float, channels: slice) -> Float:
    """Return (N, C) of the tiles at `st` (N, 2). On the edge between two, the right or upper one counts."""
    result = np.zeros((len(st), channels.stop - channels.start))
    for corner, image in tiles.images:
        on = np.flatnonzero(((st >= corner) & (st <= np.add(corner, 1))).all(1))
        result[on] = _texels(image, ("clamp", "clamp"), st[on] - corner, channels)
    return result


def _texels(image: Image, wrap: tuple[str, str], st: Float, channels: slice) -> Float:
    """Return (N, C) of one image at `st` (N, 2). For a single channel only that is decoded."""
    height, width = image.size
    single = channels.stop - channels.start == 1
    pixels = (image.channel(channels.start) if single else image.pixels).reshape(height * width, -1)
    some = slice(0, 1) if single else channels
    x, y = st[:, 0] * width - 0.5, (1 - st[:, 1]) * height - 0.5
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    result = np.zeros((len(st), some.stop - some.start))
    across = [(wx, *_wrapped(x0 + dx, width, wrap[0])) for dx, wx in ((0, 1 - fx), (1, fx))]
    for dy, wy in ((0, 1 - fy), (1, fy)):
        rows, outside_t = _wrapped(y0 + dy, height, wrap[1])
        for wx, columns, outside_s in across:
            texels = pixels.take(rows * width + columns, 0)[:, some].astype(np.float64)
            if "black" in wrap:
                texels[outside_s | outside_t] = 0
            result += wy * wx * texels
    return result


def extremes(texture: Texture) -> Float:
    """Return (2, C) lowest and highest number of each channel of a texture; bilinear look-up goes no further."""
    return _scaled(texture, texture.image.extremes)


def bounds(texture: Texture) -> Float:
    """Return (2, C) numbers below and above which none of a texture lies: `extremes`, or further apart and had without
    decoding it."""
    return _scaled(texture, texture.image.bounds)


def _scaled(texture: Texture, found_in_image: NDArray[np.float32]) -> Float:
    """Return (2, C) lowest and highest number of a texture, of those (2, 4) of its image."""
    channels = CHANNELS[texture.output]
    found = found_in_image[:, channels].astype(np.float64)
    if "black" in texture.wrap:
        found = np.concatenate([found, np.zeros((1, found.shape[1]))])
    scaled = found * np.array(texture.scale)[channels] + np.array(texture.bias)[channels]
    return np.stack([scaled.min(0), scaled.max(0)])


def _wrapped(index: Float, size: int, wrap: str) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Texel numbers (N,) within 0 to size - 1, by the `index` (N,), which is changed, and which of them lie outside a
    "black" image."""
    outside = (index < 0) | (index >= size)
    if wrap == "repeat":
        index[outside] = np.mod(index[outside], size)
    elif wrap == "mirror":
        index[outside] = np.mod(index[outside], 2 * size)
        index = np.minimum(index, 2 * size - 1 - index)
    else:
        index = np.clip(index, 0, size - 1)
    return index.astype(np.int64), outside if wrap == "black" else np.zeros_like(outside)

"""Textures and primvars as nodes, exactly as scene.derived.lookup reads them; images live in Blender.

Blender repeats an image. What lies outside it in the other ways is found before the look-up: a mirrored or clamped
coordinate keeps half a texel from the edge, where bilinear look-up is the edge texel alone; a black border is a factor,
because bilinear weights are products.
"""

from collections.abc import Iterable, Set
from typing import Any

import bpy
import numpy as np

from spin_usd.basics.arrays import digest
from spin_usd.renderers.blender.nodes import Nodes, Value
from spin_usd.scene.derived.lookup import look_up, placed
from spin_usd.scene.material import Material
from spin_usd.scene.texture import IDENTITY, Coordinates, Image, Primvar, Texture, Tiles

BYTES_PER_PIXEL = 16  # four floats
UNUSED_BYTES = 1 << 29  # of pictures kept for when their surface comes back; Cycles holds as much again


class ImageLibrary:
    """One Blender image per distinct picture."""

    def __init__(self) -> None:
        self._uploaded: dict[str, Any] = {}

    def upload(self, image: Image) -> Any:
        """Return the picture in Blender: floats that it neither converts nor multiplies by alpha."""
        if image.key not in self._uploaded:
            height, width = image.size
            made = bpy.data.images.new("texture", width, height, alpha=True, float_buffer=True, is_data=True)
            made.alpha_mode = "CHANNEL_PACKED"
            made.use_half_precision = False
            flipped, row = np.empty((height, width, 4), np.float32), height
            for band in image.bands():
                flipped[row - len(band) : row] = band[::-1]
                row -= len(band)
            made.pixels.foreach_set(flipped.ravel())
            made.update()
            self._uploaded[image.key] = made
        return self._uploaded[image.key]

    def keep(self, materials: Iterable[Material]) -> None:
        """Free the pictures that none of these uses."""
        self.keep_only(
            {image.key for material in materials for texture in textures_of(material) for image in texture.images}
        )

    def keep_only(self, keys: Set[str]) -> None:
        """Free the pictures that have none of these keys, once they are many: variants come and go.

        Cycles keeps its own copies by a picture's address, whatever becomes of the picture; so it must forget all.
        """
        unused = {key: made for key, made in self._uploaded.items() if key not in keys}
        if sum(BYTES_PER_PIXEL * made.size[0] * made.size[1] for made in unused.values()) <= UNUSED_BYTES:
            return
        for key, made in unused.items():
            del self._uploaded[key]
            bpy.data.images.remove(made)
        forget_render_data()


def forget_render_data() -> None:
    """Let Cycles free all that it kept from its last render: Blender does so when it is set to keep nothing."""
    for kept in (False, True):
        bpy.context.scene.render.use_persistent_data = kept


def textures_of(material: Material) -> list[Texture]:
    """Return the textures among a material's inputs."""
    return [value for value in vars(material).values() if isinstance(value, Texture)]


def attribute_name(primvar: str) -> str:
    """Return the name of a primvar's attribute in Blender: its own could be too long, or one to which Blender gives a
    meaning."""
    return f"primvar {digest(primvar)[:32]}"


def node_value(nodes: Nodes, images: ImageLibrary, value: Any) -> Value:
    """Return a constant as it is; the socket that computes a texture or primvar."""
    if isinstance(value, Primvar):
        return _primvar(nodes, value.name)
    return _texture(nodes, images, value) if isinstance(value, Texture) else value


def _primvar(nodes: Nodes, name: str) -> Any:
    key = ("primvar", name)
    if key not in nodes.values:
        node = nodes.add("ShaderNodeAttribute", attribute_name=attribute_name(name))
        nodes.values[key] = node.outputs["Vector"]
    return nodes.values[key]


def _texture(nodes: Nodes, images: ImageLibrary, texture: Texture) -> Value:
    where = texture.coordinates
    if where.primvar is None:
        found = look_up(texture, placed(where, np.array([where.constant], np.float64)))[0]
        return tuple(map(float, found)) if len(found) > 1 else float(found[0])
    color, alpha, inside = _texels(nodes, images, texture)
    if texture.output == "rgb":
        return _scaled_color(nodes, color, inside, texture)
    channel = "rgba".index(texture.output)
    texel = alpha if channel == 3 else _channel(nodes, color, channel)
    if inside is not None:
        texel = nodes.math("MULTIPLY", texel, inside)
    scale, bias = texture.scale[channel], texture.bias[channel]
    return texel if (scale, bias) == (1, 0) else nodes.math("MULTIPLY_ADD", texel, scale, bias)


def _scaled_color(nodes: Nodes, color: Any, inside: Any, texture: Texture) -> Any:
    if inside is not None:
        color = nodes.vector("MULTIPLY", color, inside)
    scale, bias = texture.scale[:3], texture.bias[:3]
    neutral = scale == (1, 1, 1) and bias == (0, 0, 0)
    return color if neutral else nodes.vector("MULTIPLY_ADD", color, scale, bias)


def _channel(nodes: Nodes, color: Any, channel: int) -> Any:
    key = ("channels", color.node.name)
    if key not in nodes.values:
        nodes.values[key] = nodes.add("ShaderNodeSeparateColor", [color], mode="RGB")
    return nodes.values[key].outputs[channel]


def _texels(nodes: Nodes, images: ImageLibrary, texture: Texture) -> tuple[Any, Any, Any]:
    """Colour and alpha before scale and bias, and the factor of a black border, None where there is none."""
    key = (texture.image, texture.coordinates, texture.wrap)
    if key not in nodes.values:
        st = _place(nodes, texture.coordinates)
        if isinstance(texture.image, Tiles):
            nodes.values[key] = _tiled_texels(nodes, images, texture.image, st)
        else:
            nodes.values[key] = _image_texels(nodes, images, texture.image, st, texture.wrap)
    color, alpha, inside = nodes.values[key]
    return color, alpha, inside


def _image_texels(
    nodes: Nodes, images: ImageLibrary, image: Image, st: tuple[Any, Any], wrap: tuple[str, str]
) -> tuple[Any, Any, Any]:
    height, width = image.size
    axes = [_wrapped(nodes, *axis) for axis in zip(st, (width, height), wrap, strict=True)]
    vector = nodes.add("ShaderNodeCombineXYZ", [place for place, _ in axes]).outputs[0]
    made = images.upload(image)
    node = nodes.add("ShaderNodeTexImage", [vector], image=made, interpolation="Linear", extension="REPEAT")
    factors = [factor for _, factor in axes if factor is not None]
    inside = nodes.math("MULTIPLY", *factors) if len(factors) == 2 else next(iter(factors), None)
    return node.outputs["Color"], node.outputs["Alpha"], inside


def _tiled_texels(nodes: Nodes, images: ImageLibrary, tiles: Tiles, st: tuple[Any, Any]) -> tuple[Any, Any, Any]:
    """Return the sum of all tiles; each is 0 but on its own square."""
    square = [nodes.add("ShaderNodeMath", [place], operation="FLOOR").outputs[0] for place in st]
    color: Value = (0.0, 0.0, 0.0)
    alpha: Value = 0.0
    for corner, image in tiles.images:
        s, t = (nodes.math("SUBTRACT", place, float(low)) for place, low in zip(st, corner, strict=True))
        texel, opacity, _ = _image_texels(nodes, images, image, (s, t), ("clamp", "clamp"))
        on = nodes.math("MULTIPLY", *(_equals(nodes, *pair) for pair in zip(square, corner, strict=True)))
        color = nodes.vector("MULTIPLY_ADD", texel, on, color)
        alpha = nodes.math("MULTIPLY_ADD", opacity, on, alpha)
    return color, alpha, None


def _equals(nodes: Nodes, whole: Any, number: int) -> Any:
    """1 where the socket `whole` gives that whole number, else 0."""
    return nodes.add("ShaderNodeMath", [whole, float(number), 0.5], operation="COMPARE").outputs[0]


def _place(nodes: Nodes, coordinates: Coordinates) -> tuple[Any, Any]:
    """s and t on the image."""
    key = ("place", coordinates)
    if key not in nodes.values:
        assert coordinates.primvar is not None
        s, t, _ = nodes.add("ShaderNodeSeparateXYZ", [_primvar(nodes, coordinates.primvar)]).outputs
        if coordinates.matrix != IDENTITY:
            a, b, c, d, e, f = coordinates.matrix
            rows = ((a, b, c), (d, e, f))
            s, t = (nodes.math("MULTIPLY_ADD", s, i, nodes.math("MULTIPLY_ADD", t, j, k)) for i, j, k in rows)
        nodes.values[key] = s, t
    s, t = nodes.values[key]
    return s, t


def _wrapped(nodes: Nodes, place: Any, texels: int, wrap: str) -> tuple[Any, Any]:
    """Return a coordinate within the image, and the factor of its black border or None."""
    if wrap == "repeat":
        return place, None
    edge = 0.5 / texels
    folded = nodes.add("ShaderNodeMath", [place, 1.0], operation="PINGPONG").outputs[0] if wrap == "mirror" else place
    within = nodes.clamped(folded, edge, 1 - edge)
    if wrap != "black":
        return within, None
    low = nodes.clamped(nodes.math("MULTIPLY_ADD", place, float(texels), 0.5), 0.0, 1.0)
    high = nodes.clamped(nodes.math("MULTIPLY_ADD", place, -float(texels), texels + 0.5), 0.0, 1.0)
    return within, nodes.math("MULTIPLY", low, high)

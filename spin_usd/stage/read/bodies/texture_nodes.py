"""NodeReader that make a value vary over a surface: UsdUVTexture, UsdTransform2d, UsdPrimvarReader_*.

Source: the UsdPreviewSurface specification, version 2.6.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdShade

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.texture import Coordinates, Image, Texture, Tiles
from spin_usd.stage.composition.images import COLOR_SPACES, Images
from spin_usd.stage.composition.missing_images import lacks_file
from spin_usd.stage.usd.image_tiles import is_tiled
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.shader_inputs import (
    Output,
    input_path,
    note_lost_connections,
    read_constant,
    read_input,
    read_numbers,
    read_token,
)
from spin_usd.stage.usd.values import read

READERS = {
    "UsdPrimvarReader_float": 1,
    "UsdPrimvarReader_float2": 2,
    "UsdPrimvarReader_float3": 3,
    "UsdPrimvarReader_normal": 3,
    "UsdPrimvarReader_point": 3,
    "UsdPrimvarReader_vector": 3,
    "UsdPrimvarReader_float4": 4,
}
"""The readers, and how many numbers each outputs."""

CHANNELS = {"r": slice(0, 1), "g": slice(1, 2), "b": slice(2, 3), "a": slice(3, 4), "rgb": slice(0, 3)}
NUMBERS = ("r", "g", "b")
WRAPS = ("black", "clamp", "repeat", "mirror", "useMetadata")
MAX_DEPTH = 64  # nodes in a row


@dataclass(frozen=True, kw_only=True)
class PrimvarInput:
    """An input that a primvar reader feeds: the primvar's name, and the fallback for a gprim that has none of that
    name."""

    name: str
    fallback: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class NodeReader:
    """Reads the nodes of materials at one time."""

    time: Usd.TimeCode
    images: Images
    notes: Notes = field(default_factory=Notes)

    def varying(self, output: Output, channels: int) -> Any:
        """Read the node's output of `channels` numbers: a tuple of them, a Texture or a PrimvarInput.

        Raises UnsupportedError for other nodes, StageError for an output of another count of numbers.
        """
        note_lost_connections(output.shader, self.notes)
        if output.node == "UsdUVTexture":
            _check_type(output, CHANNELS.get(output.name), channels)
            return self._texture(output)
        if output.node in READERS and output.name == "result":
            _check_type(output, slice(0, READERS[output.node]), channels)
            return self._primvar_input(output.shader)
        found = f"is connected to {output.shader.GetPath()}, which is '{output.node}'"
        do = "use UsdUVTexture or UsdPrimvarReader"
        raise UnsupportedError(found, where=output.where, do=do)

    def _texture(self, output: Output) -> Any:
        """Read the output of a UsdUVTexture; its unscaled fallback where no file is authored, or where the file is
        missing and a fallback is authored."""
        shader, time = output.shader, self.time
        asset = read_constant(shader, "file", time)
        if not isinstance(asset, Sdf.AssetPath | None):
            raise StageError(f"is {asset!r}", where=input_path(shader, "file"), do="author an asset path")
        if asset is not None and lacks_file(shader, asset):
            message = f"its image @{asset.path}@ does not exist: its fallback is rendered"
            self.notes.add("image-missing", shader.GetPath(), message)
            asset = None
        if asset is None or not asset.path:
            fallback = read_numbers(shader, "fallback", time, (0, 0, 0, 1))
            return tuple(float(v) for v in fallback[CHANNELS[output.name]])
        image, wrap = self._image(shader, asset, number=output.name in NUMBERS)
        return Texture(
            path=str(shader.GetPath()),
            image=image,
            output=output.name,
            coordinates=self._coordinates(shader, "st"),
            wrap=wrap,
            scale=_rgba(read_numbers(shader, "scale", time, (1, 1, 1, 1))),
            bias=_rgba(read_numbers(shader, "bias", time, (0, 0, 0, 0))),
        )

    def _image(
        self, shader: UsdShade.Shader, asset: Sdf.AssetPath, *, number: bool
    ) -> tuple[Image | Tiles, tuple[str, str]]:
        """Read the node's image and its wrap modes, with a note where a single `number` is decoded from sRGB."""
        space = self._color_space(shader)
        wraps = [read_token(shader, name, self.time, WRAPS, "useMetadata") for name in ("wrapS", "wrapT")]
        if is_tiled(asset):
            return self.images.read_tiles(asset, space, shader.GetPrim()), ("clamp", "clamp")
        decoded = self.images.read(asset, space, shader.GetPrim())
        if number and decoded.source.linearised:
            message = f"decodes a number, such as roughness, from sRGB, as its sourceColorSpace is {space!r}"
            self.notes.add("texture-srgb", shader.GetPath(), message)
        s, t = (own if wrap == "useMetadata" else wrap for wrap, own in zip(wraps, decoded.wrap, strict=True))
        return decoded.image, (s, t)

    def _color_space(self, shader: UsdShade.Shader) -> str:
        """Read sourceColorSpace. Raises UnsupportedError for isSRGB, its predecessor, unless it is "auto"."""
        old = read_constant(shader, "isSRGB", self.time)
        if old is not None and str(old) != "auto":
            do = "author sourceColorSpace in its place"
            raise UnsupportedError(f"is '{old}', an input of old versions", where=input_path(shader, "isSRGB"), do=do)
        return read_token(shader, "sourceColorSpace", self.time, COLOR_SPACES, "auto")

    def _coordinates(self, shader: UsdShade.Shader, name: str, depth: int = 0) -> Coordinates:
        """Read the texture coordinates from the input `name` of a texture or a transform; `constant` is the fallback of
        `primvar`."""
        value = read_input(shader, name, self.time)
        if not isinstance(value, Output):
            s, t = read_numbers(shader, name, self.time, (0, 0))
            return Coordinates(primvar=None, constant=(float(s), float(t)))
        if depth == MAX_DEPTH:
            raise StageError("is connected to itself, or to too many nodes", where=value.where, do="fix the network")
        if value.node == "UsdTransform2d" and value.name == "result":
            note_lost_connections(value.shader, self.notes)
            inner = self._coordinates(value.shader, "in", depth + 1)
            return replace(inner, matrix=self._transform(value.shader, inner))
        found = self.varying(value, 2)
        if not isinstance(found, PrimvarInput):
            raise UnsupportedError("is looked up in an image", where=value.where, do="use a UsdPrimvarReader_float2")
        s, t = found.fallback
        return Coordinates(primvar=found.name, constant=(s, t))

    def _transform(
        self, shader: UsdShade.Shader, inner: Coordinates
    ) -> tuple[float, float, float, float, float, float]:
        """Return the matrix that scales, then rotates counter-clockwise, then translates the coordinates `inner`."""
        angle = np.radians(read_numbers(shader, "rotation", self.time, (0,))[0])
        scale = read_numbers(shader, "scale", self.time, (1, 1))
        own = np.eye(3)
        own[:2, :2] = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) * scale
        own[:2, 2] = read_numbers(shader, "translation", self.time, (0, 0))
        both = own @ np.vstack([np.array(inner.matrix).reshape(2, 3), [0, 0, 1]])
        a, b, c, d, e, f = (float(v) for v in both[:2].ravel())
        return a, b, c, d, e, f

    def _primvar_input(self, shader: UsdShade.Shader) -> PrimvarInput:
        channels = READERS[str(read(shader.GetIdAttr()))]
        name = read_constant(shader, "varname", self.time)
        if not isinstance(name, str) or not Sdf.Path.IsValidNamespacedIdentifier(name):
            found = "is empty" if not name else f"is {name!r}, which is not a valid primvar name"
            raise StageError(found, where=input_path(shader, "varname"), do="name a primvar")
        fallback = read_numbers(shader, "fallback", self.time, (0.0,) * channels)
        return PrimvarInput(name=name, fallback=tuple(float(v) for v in fallback))


def _check_type(output: Output, numbers: slice | None, channels: int) -> None:
    if numbers is None:
        raise StageError(
            f"is connected to outputs:{output.name}, which does not exist", where=output.where, do="fix it"
        )
    count = numbers.stop - numbers.start
    if count != channels:
        found = (
            f"needs {channels} and is connected to {output.shader.GetPath()}.outputs:{output.name} of {count} numbers"
        )
        raise StageError(found, where=output.where, do="connect an output of its own type")


def _rgba(values: Any) -> tuple[float, float, float, float]:
    r, g, b, a = (float(v) for v in values)
    return r, g, b, a

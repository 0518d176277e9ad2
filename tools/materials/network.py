"""A material as a UsdPreviewSurface over a network of textures, which lie where its coordinates in metres say."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, UsdShade

from materials.values import MaterialValues, Picture, Sample

FLOAT, COLOUR, FLOAT4 = Sdf.ValueTypeNames.Float, Sdf.ValueTypeNames.Color3f, Sdf.ValueTypeNames.Float4
OUTPUT_TYPES = {"r": FLOAT, "rgb": Sdf.ValueTypeNames.Float3}


def author(material: UsdShade.Material, values: MaterialValues, where: Callable[[str], str]) -> None:
    """Author all nodes of a material. What it has by a reference already is replaced, and cut where it is connected.

    Args:
        material: Defined, in a stage whose edit target takes the opinions.
        values: Its inputs.
        where: Gives the asset path of a picture's file.
    """
    Network(material, where).surface(values)


class Network:
    """The nodes of one material."""

    def __init__(self, material: UsdShade.Material, where: Callable[[str], str]) -> None:
        self._material = material
        self._where = where

    def surface(self, values: MaterialValues) -> None:
        shader = self._shader("Surface", "UsdPreviewSurface")
        inputs: tuple[tuple[str, Sdf.ValueTypeName, Any], ...] = (
            ("diffuseColor", COLOUR, values.colour),
            ("metallic", FLOAT, values.metallic),
            ("roughness", FLOAT, values.roughness),
            ("clearcoat", FLOAT, values.clearcoat),
            ("clearcoatRoughness", FLOAT, values.clearcoat_roughness),
            ("ior", FLOAT, values.ior),
        )
        for name, kind, value in inputs:
            surface_input = shader.CreateInput(name, kind)
            if isinstance(value, Sample):
                surface_input.ConnectToSource(self._texture(name, value).ConnectableAPI(), value.output)
            else:
                _cut(surface_input)
                surface_input.Set(Gf.Vec3f(*value) if kind == COLOUR else value)
        if values.normal:
            texture = self._normal_map(values.normal)
            shader.CreateInput("normal", Sdf.ValueTypeNames.Normal3f).ConnectToSource(texture.ConnectableAPI(), "rgb")
        elif shader.GetInput("normal"):
            _cut(shader.GetInput("normal"))
        self._material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")

    def _texture(self, name: str, sample: Sample) -> UsdShade.Shader:
        """A UsdUVTexture for one input."""
        texture = self._picture(name, sample.picture)
        if (sample.scale, sample.bias) != (1.0, 0.0) or texture.GetInput("scale"):
            scale = sample.scale if isinstance(sample.scale, tuple) else (sample.scale,) * 3
            alpha = 1.0 if isinstance(sample.scale, tuple) else sample.scale
            texture.CreateInput("scale", FLOAT4).Set(Gf.Vec4f(*scale, alpha))
            texture.CreateInput("bias", FLOAT4).Set(Gf.Vec4f(sample.bias))
        texture.CreateOutput(sample.output, OUTPUT_TYPES[sample.output])
        return texture

    def _normal_map(self, picture: Picture) -> UsdShade.Shader:
        """A UsdUVTexture that turns colours of 0 to 1 into directions of -1 to 1."""
        texture = self._picture("normal", picture)
        texture.CreateInput("scale", FLOAT4).Set(Gf.Vec4f(2, 2, 2, 1))
        texture.CreateInput("bias", FLOAT4).Set(Gf.Vec4f(-1, -1, -1, 0))
        texture.CreateOutput("rgb", OUTPUT_TYPES["rgb"])
        return texture

    def _picture(self, name: str, picture: Picture) -> UsdShade.Shader:
        """A repeated picture, of the size it has in metres."""
        texture = self._shader(f"{name}Texture", "UsdUVTexture")
        texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(self._where(picture.file)))
        texture.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("raw" if picture.raw else "sRGB")
        for axis in ("wrapS", "wrapT"):
            texture.CreateInput(axis, Sdf.ValueTypeNames.Token).Set("repeat")
        place = self._place(picture)
        texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(place.ConnectableAPI(), "result")
        return texture

    def _place(self, picture: Picture) -> UsdShade.Shader:
        """From metres to copies of the picture; the turn comes after the scale, so that it fits square pictures
        only."""
        place = self._shader(f"{Path(picture.file).stem}_place", "UsdTransform2d")
        place.CreateInput("scale", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(*(1 / size for size in picture.metres)))
        if picture.degrees or place.GetInput("rotation"):
            place.CreateInput("rotation", FLOAT).Set(picture.degrees)
        place.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(self._reader().ConnectableAPI(), "result")
        place.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        return place

    def _reader(self) -> UsdShade.Shader:
        """The material's reader of st, one for all its pictures."""
        reader = self._shader("st", "UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        return reader

    def _shader(self, name: str, kind: str) -> UsdShade.Shader:
        prim = self._material.GetPrim()
        shader = UsdShade.Shader.Define(prim.GetStage(), prim.GetPath().AppendChild(name))
        shader.CreateIdAttr(kind)
        return shader


def _cut(shader_input: UsdShade.Input) -> None:
    if shader_input.HasConnectedSource():
        shader_input.DisconnectSource()

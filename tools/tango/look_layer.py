"""One look: a Material for every name, as a UsdPreviewSurface over texture networks."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from tango.materials import MaterialValues, Picture, Sample
from tango.paths import MATERIALS, ROOT

FLOAT, COLOUR = Sdf.ValueTypeNames.Float, Sdf.ValueTypeNames.Color3f
OUTPUT_TYPES = {"r": FLOAT, "rgb": Sdf.ValueTypeNames.Float3}


def look(stage: Usd.Stage, materials: Mapping[str, MaterialValues]) -> None:
    """Author the materials into a stage for them alone."""
    UsdGeom.Scope.Define(stage, MATERIALS)
    for name, values in materials.items():
        _material(UsdShade.Material.Define(stage, MATERIALS.AppendChild(name)), values)
    stage.GetRootLayer().GetPrimAtPath(ROOT).specifier = Sdf.SpecifierOver
    stage.Save()


def _material(material: UsdShade.Material, values: MaterialValues) -> None:
    shader = _shader(material, "Surface", "UsdPreviewSurface")
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
            texture = _texture(material, name, value)
            surface_input.ConnectToSource(texture.ConnectableAPI(), value.output)
        else:
            surface_input.Set(Gf.Vec3f(*value) if kind == COLOUR else value)
    if values.normal:
        texture = _normal_map(material, values.normal)
        shader.CreateInput("normal", Sdf.ValueTypeNames.Normal3f).ConnectToSource(texture.ConnectableAPI(), "rgb")
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")


def _texture(material: UsdShade.Material, name: str, sample: Sample) -> UsdShade.Shader:
    """A UsdUVTexture for one input."""
    texture = _picture(material, name, sample.picture)
    if (sample.scale, sample.bias) != (1.0, 0.0):
        texture.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(sample.scale))
        texture.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(sample.bias))
    texture.CreateOutput(sample.output, OUTPUT_TYPES[sample.output])
    return texture


def _normal_map(material: UsdShade.Material, picture: Picture) -> UsdShade.Shader:
    """A UsdUVTexture that turns colours of 0 to 1 into directions of -1 to 1."""
    texture = _picture(material, "normal", picture)
    texture.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(2, 2, 2, 1))
    texture.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(-1, -1, -1, 0))
    texture.CreateOutput("rgb", OUTPUT_TYPES["rgb"])
    return texture


def _picture(material: UsdShade.Material, name: str, picture: Picture) -> UsdShade.Shader:
    """A repeated picture, of the size it has in metres."""
    texture = _shader(material, f"{name}Texture", "UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(f"./textures/{picture.file}"))
    texture.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("raw" if picture.raw else "sRGB")
    for axis in ("wrapS", "wrapT"):
        texture.CreateInput(axis, Sdf.ValueTypeNames.Token).Set("repeat")
    place = _place(material, picture)
    texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(place.ConnectableAPI(), "result")
    return texture


def _place(material: UsdShade.Material, picture: Picture) -> UsdShade.Shader:
    """From metres to copies of the picture; the turn comes after the scale, so that it fits square pictures only."""
    place = _shader(material, f"{Path(picture.file).stem}_place", "UsdTransform2d")
    place.CreateInput("scale", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(*(1 / size for size in picture.metres)))
    if picture.degrees:
        place.CreateInput("rotation", FLOAT).Set(picture.degrees)
    place.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(_reader(material).ConnectableAPI(), "result")
    place.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    return place


def _reader(material: UsdShade.Material) -> UsdShade.Shader:
    """The material's reader of st, one for all its pictures."""
    reader = _shader(material, "st", "UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    return reader


def _shader(material: UsdShade.Material, name: str, kind: str) -> UsdShade.Shader:
    shader = UsdShade.Shader.Define(material.GetPrim().GetStage(), material.GetPath().AppendChild(name))
    shader.CreateIdAttr(kind)
    return shader

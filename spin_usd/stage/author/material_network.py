"""A model's material as UsdPreviewSurface, fed by UsdUVTexture, UsdTransform2d and UsdPrimvarReader where it varies.

Inputs that use the same image in the same way share one node.
"""

from collections.abc import Mapping
from dataclasses import replace

from pxr import Gf, Sdf, Usd, UsdShade

from spin_usd.errors import UnsupportedError
from spin_usd.scene.asset import ImageFile, ImageMap, ImageTransform, ModelMaterial
from spin_usd.scene.material import TRANSPARENT, Material
from spin_usd.scene.texture import Primvar

TYPES = Sdf.ValueTypeNames
COLORS = {"diffuseColor": "diffuse_color", "emissiveColor": "emissive_color", "specularColor": "specular_color"}
NUMBERS = {"metallic": "metallic", "roughness": "roughness", "opacity": "opacity", "ior": "ior"}
COAT = {"clearcoat": "clearcoat", "clearcoatRoughness": "clearcoat_roughness"}
INPUT_TYPES = {"normal": TYPES.Normal3f, **dict.fromkeys(COLORS, TYPES.Color3f)}  # the others are floats


def author_material(
    stage: Usd.Stage, path: Sdf.Path, material: ModelMaterial, files: Mapping[ImageFile, str]
) -> UsdShade.Material:
    """Author the material at `path`; `files` are the asset paths of its images."""
    made = UsdShade.Material.Define(stage, path)
    made.GetPrim().SetDisplayName(material.constants.path)
    surface = _node(stage, path.AppendChild("Surface"), "UsdPreviewSurface")
    _author_constants(surface, material.constants)
    made.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", TYPES.Token))
    nodes: dict[ImageMap, UsdShade.Shader] = {}
    for name, image in material.images.items():
        use = replace(image, output="rgb")
        if use not in nodes:
            nodes[use] = _texture(stage, path.AppendChild(f"{name}Texture"), image, files[image.file])
        surface_input = surface.CreateInput(name, INPUT_TYPES.get(name, TYPES.Float))
        surface_input.GetAttr().Clear()  # a connection beats the constant
        kind = TYPES.Float3 if image.output == "rgb" else TYPES.Float
        surface_input.ConnectToSource(nodes[use].CreateOutput(image.output, kind))
    return made


def _author_constants(surface: UsdShade.Shader, constants: Material) -> None:
    for name, field in COLORS.items():
        value = getattr(constants, field)
        color = surface.CreateInput(name, TYPES.Color3f)
        if isinstance(value, Primvar):
            color.ConnectToSource(_reader(surface.GetPrim(), value.name, "float3", TYPES.Float3))
        elif isinstance(value, tuple):
            color.Set(Gf.Vec3f(*value))
        else:
            raise UnsupportedError(f"its {name} is not a constant", where=constants.path)
    surface.CreateInput("useSpecularWorkflow", TYPES.Int).Set(int(constants.use_specular_workflow))
    coat = COAT if constants.clearcoat else {}
    for name, field in (NUMBERS | coat).items():
        surface.CreateInput(name, TYPES.Float).Set(getattr(constants, field))
    if constants.cut_out:
        surface.CreateInput("opacityThreshold", TYPES.Float).Set(constants.opacity_threshold)
    if constants.opacity_mode != TRANSPARENT:
        surface.CreateInput("opacityMode", TYPES.Token).Set(constants.opacity_mode)


def _texture(stage: Usd.Stage, path: Sdf.Path, image: ImageMap, file: str) -> UsdShade.Shader:
    node = _node(stage, path, "UsdUVTexture")
    node.CreateInput("file", TYPES.Asset).Set(Sdf.AssetPath(file))
    node.CreateInput("sourceColorSpace", TYPES.Token).Set(image.color_space)
    for name, wrap in zip(("wrapS", "wrapT"), image.wrap, strict=True):
        node.CreateInput(name, TYPES.Token).Set(wrap)
    node.CreateInput("scale", TYPES.Float4).Set(Gf.Vec4f(*image.scale))
    node.CreateInput("bias", TYPES.Float4).Set(Gf.Vec4f(*image.bias))
    node.CreateInput("st", TYPES.Float2).ConnectToSource(_coordinates(node, image))
    return node


def _coordinates(texture: UsdShade.Shader, image: ImageMap) -> UsdShade.Output:
    """Author the texture coordinates: the primvar, transformed where the placement asks for it."""
    read = _reader(texture.GetPrim(), image.primvar, "float2", TYPES.Float2)
    placement = image.placement
    if placement == ImageTransform():
        return read
    path = texture.GetPath()
    node = _node(texture.GetPrim().GetStage(), path.ReplaceName(f"{path.name}ImageTransform"), "UsdTransform2d")
    node.CreateInput("in", TYPES.Float2).ConnectToSource(read)
    node.CreateInput("scale", TYPES.Float2).Set(Gf.Vec2f(*placement.scale))
    node.CreateInput("rotation", TYPES.Float).Set(placement.rotation_deg)
    node.CreateInput("translation", TYPES.Float2).Set(Gf.Vec2f(*placement.translation))
    return node.CreateOutput("result", TYPES.Float2)


def _reader(beside: Usd.Prim, primvar: str, kind: str, output: Sdf.ValueTypeName) -> UsdShade.Output:
    path = beside.GetPath().ReplaceName(f"{primvar}Reader")
    node = _node(beside.GetStage(), path, f"UsdPrimvarReader_{kind}")
    node.CreateInput("varname", TYPES.String).Set(primvar)
    return node.CreateOutput("result", output)


def _node(stage: Usd.Stage, path: Sdf.Path, identifier: str) -> UsdShade.Shader:
    node = UsdShade.Shader.Define(stage, path)
    node.CreateIdAttr(identifier)
    return node

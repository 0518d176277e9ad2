"""A mesh file's model as a USD asset: an interface layer whose payload is the materials over the geometry."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdSemantics, UsdShade, Vt

from spin_usd.basics.arrays import Float
from spin_usd.basics.unique_names import UniqueNames
from spin_usd.errors import UnsupportedError
from spin_usd.geometry.triangles import unit_vectors
from spin_usd.scene.asset import ImageFile, ImageMap, ImageTransform, MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.material import TRANSPARENT, Material
from spin_usd.scene.texture import Primvar
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.read.bodies.part_labels import MAX_LABEL
from spin_usd.stage.usd.conversion import box, identifier, int_array, unique_identifiers, vec2f_array, vec3f_array
from spin_usd.stage.usd.layer_file import author_metadata, export, writing
from spin_usd.stage.usd.shader_inputs import PREVIEW_SURFACE

NEUTRAL = ModelMaterial(constants=Material(path="neutral"))  # UsdPreviewSurface's own fallbacks: 18 % grey
CLASS_OF_A_MODEL = "spacecraft"
MATERIALS = "mtl"
SHAPE = "Shape"
"""The mesh that copies share."""
FOLDER = "textures"
NOT_ALLOWED = re.compile(r"[^A-Za-z0-9_-]")  # "<UDIM>", "@" and brackets mean something in asset paths
TYPES = Sdf.ValueTypeNames
COLORS = {"diffuseColor": "diffuse_color", "emissiveColor": "emissive_color", "specularColor": "specular_color"}
NUMBERS = {"metallic": "metallic", "roughness": "roughness", "opacity": "opacity", "ior": "ior"}
COAT = {"clearcoat": "clearcoat", "clearcoatRoughness": "clearcoat_roughness"}
INPUT_TYPES = {"normal": TYPES.Normal3f, **dict.fromkeys(COLORS, TYPES.Color3f)}  # the others are floats


def write_mesh_target(asset: MeshAsset, folder: Path, name: str) -> Path:
    """Write the asset's layers into `folder` and return the interface layer, <name>.usda. Raises OutputError.

    <name>/<name>.usda (interface) -> payload.usda -> look.usda over geometry.usdc, and the images in textures/. Each
    part is one Mesh, labelled with the part's name, within a PointInstancer if it has copies; the asset's class is
    "spacecraft".
    """
    prim = name[:1].upper() + name[1:]
    root = Sdf.Path.absoluteRootPath.AppendChild(prim)
    paths = [
        root.AppendChild(child) for child in unique_identifiers([MATERIALS, *(part.name for part in asset.parts)])[1:]
    ]
    paths = [
        path if part.copies is None else path.AppendChild(SHAPE) for path, part in zip(paths, asset.parts, strict=True)
    ]
    geometry = _layer(prim, "The parts' meshes, metres, body axes.")
    look = _layer(prim, "Materials, and which part has which.")
    payload = _layer(prim, "Everything below the interface: the look over the geometry.")
    payload.subLayerPaths = ["./look.usda", "./geometry.usdc"]
    author_geometry(geometry, root, paths, asset)
    _author_look(look, root, root.AppendChild(MATERIALS), paths, asset)
    interface = _interface(prim, asset, name)
    write_images(asset, folder)
    for layer, file in ((geometry, "geometry.usdc"), (look, "look.usda"), (payload, "payload.usda")):
        export(layer, folder / file)
    export(interface, folder / f"{name}.usda")
    return folder / f"{name}.usda"


def target_name(text: str) -> str:
    """Turn `text` into the name of a target's folder and file."""
    return identifier(text).lower()


def _layer(prim: str, documentation: str) -> Sdf.Layer:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=prim, documentation=documentation)
    return layer


def _interface(prim: str, asset: MeshAsset, name: str) -> Sdf.Layer:
    layer = _layer(prim, f"The target {asset.name}, made by spin-usd author from a mesh file.")
    author_interface(stage_on(layer), prim, asset, name)
    # As a spec once the stage is closed, because the payload is not there yet to be composed.
    layer.GetPrimAtPath(f"/{prim}").payloadList.prependedItems = [Sdf.Payload("./payload.usda")]
    return layer


def author_interface(stage: Usd.Stage, prim: str, asset: MeshAsset, name: str) -> None:
    """Author the root of a model: its kind, its name, its extent and its class."""
    root = UsdGeom.Xform.Define(stage, f"/{prim}").GetPrim()
    model = Usd.ModelAPI(root)
    model.SetKind(Kind.Tokens.component)
    model.SetAssetName(name)
    model.SetAssetIdentifier(Sdf.AssetPath(f"./{name}.usda"))
    Usd.ColorSpaceAPI.Apply(root).CreateColorSpaceNameAttr(Gf.ColorSpaceNames.LinearRec709)
    UsdGeom.ModelAPI.Apply(root).SetExtentsHint(box(np.concatenate([_used_points(part) for part in asset.parts])))
    _label(root, "class", CLASS_OF_A_MODEL)


def _used_points(part: MeshPart) -> Float:
    used = np.zeros(len(part.points), bool)
    used[part.face_indices] = True
    found: Float = part.points[used]
    if part.copies is None:
        return found
    corners = np.stack(np.meshgrid(*np.stack([found.min(0), found.max(0)], 1)), -1).reshape(-1, 3)
    return np.concatenate([corners @ copy[:3, :3].T + copy[:3, 3] for copy in part.copies])


def author_geometry(layer: Sdf.Layer, root: Sdf.Path, paths: list[Sdf.Path], asset: MeshAsset) -> None:
    """Author the meshes of the asset's parts at `paths`."""
    instancers = {path.GetParentPath(): "PointInstancer" for path in paths if path.GetParentPath() != root}
    stage = _stage_of(layer, {root: "Xform", **instancers, **dict.fromkeys(paths, "Mesh")})
    for path, part in zip(paths, asset.parts, strict=True):
        _author_mesh(UsdGeom.Mesh.Define(stage, path), part)
        if part.copies is not None:
            _author_copies(UsdGeom.PointInstancer.Define(stage, path.GetParentPath()), path, part.copies)


def _author_copies(instancer: UsdGeom.PointInstancer, prototype: Sdf.Path, copies: Float) -> None:
    scales = np.linalg.norm(copies[:, :3, :3], axis=1)
    turns = (copies[:, :3, :3] / scales[:, None]).swapaxes(1, 2)  # row vectors
    instancer.CreatePrototypesRel().SetTargets([prototype])
    instancer.CreateProtoIndicesAttr([0] * len(copies))
    instancer.CreatePositionsAttr(vec3f_array(copies[:, :3, 3]))
    instancer.CreateScalesAttr(vec3f_array(scales))
    quats = [Gf.Quatf(Gf.Matrix3d(turn.tolist()).ExtractRotation().GetQuat()) for turn in turns]
    instancer.CreateOrientationsfAttr(Vt.QuatfArray(quats))
    time = Usd.TimeCode.Default()
    instancer.CreateExtentAttr(instancer.ComputeExtentAtTime(time, time))


def _stage_of(layer: Sdf.Layer, prims: Mapping[Sdf.Path, str]) -> Usd.Stage:
    """Return a stage on the layer with `prims` of these types, overs where it is empty, made at once: a stage takes
    longer for each the more siblings it has."""
    with Sdf.ChangeBlock():
        for path, kind in prims.items():
            above = layer if path.IsRootPrimPath() else layer.GetPrimAtPath(path.GetParentPath())
            Sdf.PrimSpec(above, path.name, Sdf.SpecifierDef if kind else Sdf.SpecifierOver, kind)
    return stage_on(layer)


def _author_mesh(mesh: UsdGeom.Mesh, part: MeshPart) -> None:
    mesh.CreatePointsAttr(vec3f_array(part.points))
    mesh.CreateFaceVertexCountsAttr(int_array(part.face_counts))
    mesh.CreateFaceVertexIndicesAttr(int_array(part.face_indices))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateExtentAttr(box(part.points))
    faceted = part.normals is None  # smooth to Blender unless authored
    mesh.CreateNormalsAttr(vec3f_array(unit_vectors(part.areas[0]) if faceted else _unit(part)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.uniform if faceted else UsdGeom.Tokens.faceVarying)
    _author_primvars(mesh, part)
    mesh.GetPrim().SetDisplayName(part.name)
    _label(mesh.GetPrim(), "part", part.name)
    for taxonomy, label in part.labels.items():
        _label(mesh.GetPrim(), taxonomy, label)
    if part.groups:
        _label(mesh.GetPrim(), "group", *part.groups)


def _author_primvars(mesh: UsdGeom.Mesh, part: MeshPart) -> None:
    for name, values in part.primvars.items():
        is_color = values.shape[1] == 3
        kind = Sdf.ValueTypeNames.Color3fArray if is_color else Sdf.ValueTypeNames.TexCoord2fArray
        primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(name, kind, UsdGeom.Tokens.faceVarying)
        primvar.Set(vec3f_array(values) if is_color else vec2f_array(values))


def _unit(part: MeshPart) -> Float:
    """Return the corners' normals (C, 3) at unit length; the face's own where the file's is zero."""
    assert part.normals is not None
    length = np.linalg.norm(part.normals, axis=1, keepdims=True)
    normals = np.where(length > 0, part.normals, np.repeat(part.areas[0], part.face_counts, axis=0))
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny))


def _author_look(layer: Sdf.Layer, root: Sdf.Path, scope: Sdf.Path, paths: list[Sdf.Path], asset: MeshAsset) -> None:
    above = {path.GetParentPath(): "" for path in paths}
    stage = _stage_of(layer, {root: "", scope: "Scope", **above, **dict.fromkeys(paths, "")})
    materials = [*asset.materials, NEUTRAL]  # the last is for faces without one: index -1
    names = unique_identifiers([material.constants.path for material in materials])
    files = asset_paths(asset)
    used = {int(i) % len(materials) for part in asset.parts for i in np.unique(part.face_material)}
    made = {i: author_material(stage, scope.AppendChild(names[i]), materials[i], files) for i in sorted(used)}
    layer.GetPrimAtPath(root).specifier = Sdf.SpecifierOver
    for path, part in zip(paths, asset.parts, strict=True):
        bind_faces(stage.OverridePrim(path), part.face_material % len(materials), made)


def bind_faces(prim: Usd.Prim, face_material: NDArray[np.int32], made: dict[int, UsdShade.Material]) -> None:
    """Bind the whole mesh when it has one material, else a partition of its faces."""
    binding = UsdShade.MaterialBindingAPI.Apply(prim)
    used = np.unique(face_material)
    if len(used) == 1:
        binding.Bind(made[int(used[0])])
        return
    for index in used:
        material = made[int(index)]
        subset = UsdGeom.Subset.Define(prim.GetStage(), prim.GetPath().AppendChild(material.GetPrim().GetName()))
        subset.CreateElementTypeAttr(UsdGeom.Tokens.face)
        subset.CreateFamilyNameAttr(UsdShade.Tokens.materialBind)
        subset.CreateIndicesAttr(int_array(np.flatnonzero(face_material == index)))
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)
    # The family's type as a plain attribute: the mesh is only an `over` here.
    family = prim.CreateAttribute("subsetFamily:materialBind:familyType", Sdf.ValueTypeNames.Token, custom=False)
    family.Set(UsdGeom.Tokens.partition)


def _label(prim: Usd.Prim, taxonomy: str, *labels: str) -> None:
    UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([*map(_printable, labels)])


def _printable(name: str) -> str:
    """Return a name that is valid as a label: files of old encodings contain unprintable characters, and some names are
    paths."""
    return "".join(each if each.isprintable() else "_" for each in name)[:MAX_LABEL]


def asset_paths(asset: MeshAsset) -> Mapping[ImageFile, str]:
    """Return the asset path of each image of `asset`, relative to the target's layers. Equal images share one file."""
    paths: dict[ImageFile, str] = {}
    by_data: dict[bytes, str] = {}
    names = UniqueNames()
    for file in (image.file for material in asset.materials for image in material.images.values()):
        if file.data not in by_data:
            stem, suffix = Path(file.name).stem, Path(file.name).suffix
            by_data[file.data] = f"./{FOLDER}/{names.give(NOT_ALLOWED.sub('_', stem) or 'image', suffix)}"
        paths[file] = by_data[file.data]
    return paths


def write_images(asset: MeshAsset, folder: Path) -> None:
    """Write the images below `folder`. Raises OutputError."""
    for file, path in asset_paths(asset).items():
        target = folder / path
        with writing(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(file.data)


def author_material(
    stage: Usd.Stage, path: Sdf.Path, material: ModelMaterial, files: Mapping[ImageFile, str]
) -> UsdShade.Material:
    """Author the material at `path` as UsdPreviewSurface; `files` are the asset paths of its images.

    UsdUVTexture, UsdTransform2d and UsdPrimvarReader feed it where it varies. Inputs that use the same image in the
    same way share one node.
    """
    made = UsdShade.Material.Define(stage, path)
    made.GetPrim().SetDisplayName(material.constants.path)
    surface = _node(stage, path.AppendChild("Surface"), PREVIEW_SURFACE)
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
    """Author the texture coordinates: the primvar, transformed if the placement requires it."""
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

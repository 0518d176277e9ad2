"""A stage written to disk: dataset.usda over one layer for each concern.

Base values are referenced, so that a variant on /World can override each of them; only the poses and the variant sets
themselves are local (sublayers). The target is in its own axes:
T_world_body = T_world_cam @ T_cam_body.
"""

from collections.abc import Mapping
from pathlib import Path

from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdRender

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.resources import bundled
from spin_usd.scene.poses import PoseList
from spin_usd.stage.author.diffuse_materials import find_diffuse_overrides
from spin_usd.stage.author.lights_and_environment import KINDS, USUAL
from spin_usd.stage.author.paths import CAMERA, MODEL, TARGET, WORLD
from spin_usd.stage.author.poses_layer import T_WORLD_CAM, poses_layer
from spin_usd.stage.author.presets import Preset
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.author.target_prim import asset_reference, author_target
from spin_usd.stage.author.target_root import Origin, author_origin
from spin_usd.stage.author.variant_sets import LAYER as VARIANT_SETS_LAYER
from spin_usd.stage.author.variant_sets import write_variant_sets
from spin_usd.stage.composition.copy_stage import copy_assets
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.read.lens import read_lens
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import quatd, vec3d
from spin_usd.stage.usd.layer_file import author_metadata, export, writing

ROOT = "dataset.usda"
MODEL_LAYER = "layers/model.usda"
SETTINGS = Sdf.Path("/Render/Settings")


def write_stage(
    folder: Path,
    *,
    poses: PoseList,
    target: TargetAsset,
    camera: Sdf.Layer,
    origin: Origin,
    seed: int,
    outputs: Mapping[str, str],
    preset: Preset | None = None,
    surroundings: Mapping[str, Sdf.Layer] | None = None,
) -> Path:
    """Write the layers into `folder`, where `target` lies already, and return the root layer's path.

    `camera` is a layer as `author.camera_layer` makes it; it is changed. `outputs`: the files of a picture, each with
    the USD type of its pixels. `surroundings`: layers by their kind, instead of the preset's and the usual ones. Raises
    OutputError, InputError for a file that one of them names and that is not there.
    """
    if preset:
        preset.set_camera(camera)
    own = _write_layers(folder / "layers", poses, camera, outputs, preset, surroundings or {})
    write_variant_sets(folder / "layers", own, target.variants, find_diffuse_overrides(target.file, target.prim))
    with writing(folder / ROOT):
        root = Sdf.Layer.CreateNew(str(folder / ROOT))
    author_metadata(root, default_prim=WORLD.name, frames=len(poses), documentation=_documentation(poses, target))
    root.subLayerPaths = [f"./layers/{VARIANT_SETS_LAYER}", "./layers/poses.usdc"]
    stage = stage_on(root)
    stage.SetMetadata("renderSettingsPrimPath", str(SETTINGS))
    _author_world(stage, origin, seed)
    for name in ("camera", "lights", "environment"):
        prim = stage.DefinePrim(WORLD.AppendChild(name.capitalize()))
        prim.GetReferences().AddReference(f"./layers/{name}.usda")
    _author_target(stage, target, folder, preset.chosen(target.variants) if preset else {})
    stage.DefinePrim("/Render").GetReferences().AddReference("./layers/render.usda")
    UsdRender.Settings(stage.OverridePrim(SETTINGS)).CreateCameraRel().SetTargets([CAMERA])
    export(root, folder / ROOT)
    return folder / ROOT


def _write_layers(
    folder: Path,
    poses: PoseList,
    camera: Sdf.Layer,
    outputs: Mapping[str, str],
    preset: Preset | None,
    surroundings: Mapping[str, Sdf.Layer],
) -> dict[Sdf.Path, Sdf.Layer]:
    """Write the layers that the root layer references. Returns those of lights and environment, by the prims' paths."""
    lens = _place_camera(camera)
    export(poses_layer(poses), folder / "poses.usdc")
    export(camera, folder / "camera.usda")
    export(render_layer(lens, outputs), folder / "render.usda")
    chosen: dict[Sdf.Path, Sdf.Layer] = {}
    for kind, place in KINDS.items():
        own = surroundings.get(kind) or (preset.layer(place) if preset else None)
        if own:
            copy_assets(own, folder / kind)
        chosen[place] = own or open_layer(bundled(kind, USUAL[kind]))
        export(chosen[place], folder / f"{kind}.usda")
    return chosen


def _place_camera(layer: Sdf.Layer) -> Camera:
    """Place the layer's camera at the origin, looking along +Y with +Z up. Returns its intrinsics."""
    stage = stage_on(layer)
    prim = stage.GetDefaultPrim()
    pose = T_WORLD_CAM @ T_CAM_USDCAM
    xformable = UsdGeom.Xformable(prim)
    xformable.ClearXformOpOrder()
    xformable.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(vec3d(pose.translation))
    xformable.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(quatd(pose.quaternion))
    return read_lens(prim)


def _author_world(stage: Usd.Stage, origin: Origin, seed: int) -> None:
    world = UsdGeom.Xform.Define(stage, WORLD).GetPrim()
    Usd.ModelAPI(world).SetKind(Kind.Tokens.assembly)
    world.ApplyAPI(schema.CAPTURE_API)
    world.GetAttribute(schema.CAPTURE_SEED).Set(seed)
    author_origin(stage.GetRootLayer(), world, origin)


def _author_target(stage: Usd.Stage, target: TargetAsset, folder: Path, selections: Mapping[str, str]) -> None:
    reference = asset_reference(target, _file(target, folder))
    if selections:
        _write_model(target, folder, selections)
        reference = Sdf.Reference(f"./{MODEL_LAYER}")
    author_target(stage, TARGET, target, reference)


def _write_model(target: TargetAsset, folder: Path, selections: Mapping[str, str]) -> None:
    """Write the target with its variants selected, in a layer between: a variant on /World may select others."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=MODEL.name, documentation="The target as the preset selects it.")
    stage = stage_on(layer)
    prim = stage.DefinePrim(Sdf.Path.absoluteRootPath.AppendChild(MODEL.name))
    prim.GetReferences().AddReference(f".{_file(target, folder)}", target.prim or Sdf.Path())
    for name, variant in selections.items():
        prim.GetVariantSet(name).SetVariantSelection(variant)
    export(layer, folder / MODEL_LAYER)


def _file(target: TargetAsset, folder: Path) -> str:
    """Return the asset path of the target's layer, relative to the stage in `folder`."""
    return f"./{target.file.relative_to(folder).as_posix()}"


def _documentation(poses: PoseList, target: TargetAsset) -> str:
    return (
        f"{len(poses)} pictures of {target.name}: time code i is picture i. The camera stands at the origin and looks "
        "along +Y; the target moves (layers/poses.usdc)."
    )


def render_layer(camera: Camera, outputs: Mapping[str, str]) -> Sdf.Layer:
    """Make an anonymous layer with /Render: a product for each of `outputs`, which gives a pixel's USD type by name.
    Its camera is set by the layer that references it, since it lies outside."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim="Render", documentation="What is rendered: resolution, products, labels.")
    stage = stage_on(layer)
    UsdGeom.Scope.Define(stage, "/Render")
    UsdGeom.Scope.Define(stage, "/Render/Products")
    UsdGeom.Scope.Define(stage, "/Render/Vars")
    settings = UsdRender.Settings.Define(stage, SETTINGS)
    settings.CreateResolutionAttr(Gf.Vec2i(camera.width, camera.height))
    settings.CreatePixelAspectRatioAttr(camera.fy / camera.fx)
    settings.CreateIncludedPurposesAttr([UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    settings.CreateProductsRel().SetTargets([_product(stage, name, kind) for name, kind in outputs.items()])
    return layer


def _product(stage: Usd.Stage, name: str, kind: str) -> Sdf.Path:
    """Define a product of one variable: each label is a file of its own."""
    variable = UsdRender.Var.Define(stage, f"/Render/Vars/{name}")
    variable.CreateDataTypeAttr(kind)
    variable.CreateSourceNameAttr(name)
    variable.CreateSourceTypeAttr(UsdRender.Tokens.raw)
    product = UsdRender.Product.Define(stage, f"/Render/Products/{name}")
    product.CreateProductTypeAttr(UsdRender.Tokens.raster)
    product.CreateProductNameAttr(name)
    product.CreateOrderedVarsRel().SetTargets([variable.GetPath()])
    return product.GetPath()

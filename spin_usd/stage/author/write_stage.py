"""A stage written to disk: dataset.usda over one layer for each concern.

Base values are referenced, so that a variant on /World can override each of them; only the poses and the variant sets
themselves are local (sublayers). The target is in its own axes:
T_world_body = T_world_cam @ T_cam_body.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdRender

from spin_usd.basics.resources import bundled
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.frames import T_CAM_USDCAM, T_USDCAM_CAM
from spin_usd.geometry.transform import Transform
from spin_usd.scene.poses import PoseList
from spin_usd.stage.author.camera_layer import FurtherCamera, layer_name
from spin_usd.stage.author.diffuse_materials import find_diffuse_overrides
from spin_usd.stage.author.lights_and_environment import SURROUNDING_PRIMS, USUAL
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
PRODUCTS, VARIABLES = Sdf.Path("/Render/Products"), Sdf.Path("/Render/Vars")


@dataclass(frozen=True, kw_only=True, eq=False)
class StageSources:
    """The sources of a stage besides its poses and its target."""

    camera: Sdf.Layer
    """As `author.camera_layer` makes it; it is changed."""
    camera_name: str = ""
    """Name of the camera, if not its prim's."""
    further: Sequence[FurtherCamera] = ()
    """Cameras mounted on the first, whose layers are changed too."""
    preset: Preset | None = None
    surroundings: Mapping[str, Sdf.Layer] = field(default_factory=dict)
    """Layers by their kind, instead of the preset's and the usual ones."""
    origin: Origin
    seed: int


def write_stage(
    folder: Path,
    sources: StageSources,
    *,
    poses: PoseList,
    target: TargetAsset,
    outputs: Mapping[str, str],
    shown: str = "",
) -> Path:
    """Write the layers into `folder`, where `target` lies already, and return the root layer's path.

    `outputs`: the files of a picture, each with the USD type of its pixels. `shown`: the content of the pictures
    in words, by default the target's name. Raises OutputError, InputError for a file that one of the sources names and
    that is not there.
    """
    preset = sources.preset
    if preset:
        for layer in (sources.camera, *(each.layer for each in sources.further)):
            preset.set_camera(layer)
    own = _write_layers(folder / "layers", sources, poses, outputs)
    write_variant_sets(folder / "layers", own, target.variants, find_diffuse_overrides(target.file, target.prim))
    with writing(folder / ROOT):
        root = Sdf.Layer.CreateNew(str(folder / ROOT))
    documentation = _documentation(len(poses), shown or target.name)
    author_metadata(root, default_prim=WORLD.name, frames=len(poses), documentation=documentation)
    root.subLayerPaths = [f"./layers/{VARIANT_SETS_LAYER}", "./layers/poses.usdc"]
    stage = stage_on(root)
    stage.SetMetadata("renderSettingsPrimPath", str(SETTINGS))
    _author_world(stage, sources.origin, sources.seed)
    for name in ("camera", "lights", "environment"):
        prim = stage.DefinePrim(WORLD.AppendChild(name.capitalize()))
        prim.GetReferences().AddReference(f"./layers/{name}.usda")
    _author_target(stage, target, folder, preset.chosen(target.variants) if preset else {})
    stage.DefinePrim("/Render").GetReferences().AddReference("./layers/render.usda")
    UsdRender.Settings(stage.OverridePrim(SETTINGS)).CreateCameraRel().SetTargets([CAMERA])
    if sources.camera_name:
        stage.GetPrimAtPath(CAMERA).SetDisplayName(sources.camera_name)
    for each in sources.further:
        _author_further(stage, each, outputs)
    export(root, folder / ROOT)
    return folder / ROOT


def _write_layers(
    folder: Path, sources: StageSources, poses: PoseList, outputs: Mapping[str, str]
) -> dict[Sdf.Path, Sdf.Layer]:
    """Write the layers that the root layer references. Returns the layers of lights and environment, by the prims'
    paths."""
    lens = _place_camera(sources.camera, T_WORLD_CAM @ T_CAM_USDCAM)
    lenses = {each.name: _place_camera(each.layer, _below_first(each.T_first_cam)) for each in sources.further}
    export(poses_layer(poses), folder / "poses.usdc")
    export(sources.camera, folder / layer_name(""))
    for each in sources.further:
        export(each.layer, folder / layer_name(each.name))
    export(render_layer(lens, outputs, lenses), folder / "render.usda")
    chosen: dict[Sdf.Path, Sdf.Layer] = {}
    for kind, place in SURROUNDING_PRIMS.items():
        own = sources.surroundings.get(kind) or (sources.preset.layer(place) if sources.preset else None)
        if own:
            copy_assets(own, folder / kind)
        chosen[place] = own or open_layer(bundled(kind, USUAL[kind]))
        export(chosen[place], folder / f"{kind}.usda")
    return chosen


def _below_first(T_first_cam: Transform) -> Transform:
    """Return the pose of a further camera's prim below the first's."""
    return T_USDCAM_CAM @ T_first_cam @ T_CAM_USDCAM


def _place_camera(layer: Sdf.Layer, pose: Transform) -> Camera:
    """Place the layer's camera in the axes of its parent: the first at the origin, looking along +Y with +Z up. Returns
    its intrinsics."""
    stage = stage_on(layer)
    prim = stage.GetDefaultPrim()
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
    Usd.ColorSpaceAPI.Apply(world).CreateColorSpaceNameAttr(Gf.ColorSpaceNames.LinearRec709)
    author_origin(stage.GetRootLayer(), world, origin)


def _author_further(stage: Usd.Stage, camera: FurtherCamera, outputs: Mapping[str, str]) -> None:
    """Mount a further camera on the first, and let its products name it."""
    prim = stage.DefinePrim(CAMERA.AppendChild(f"Camera_{camera.name}"))
    prim.GetReferences().AddReference(f"./layers/{layer_name(camera.name)}")
    prim.SetDisplayName(camera.name)
    for output in outputs:
        product = UsdRender.Product(stage.OverridePrim(PRODUCTS.AppendChild(_product_name(output, camera.name))))
        product.CreateCameraRel().SetTargets([prim.GetPath()])


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


def _documentation(count: int, shown: str) -> str:
    return (
        f"{count} pictures of {shown}: time code i is picture i. The camera stands at the origin and looks "
        "along +Y; the target moves (layers/poses.usdc)."
    )


def render_layer(camera: Camera, outputs: Mapping[str, str], further: Mapping[str, Camera]) -> Sdf.Layer:
    """Make an anonymous layer with /Render: a product for each of `outputs`, which gives a pixel's USD type by name, of
    the first camera and of each of the `further` ones, by their names. Cameras are set by the layer that references it,
    since they lie outside."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim="Render", documentation="The RenderSettings: resolution, products, labels.")
    stage = stage_on(layer)
    UsdGeom.Scope.Define(stage, "/Render")
    UsdGeom.Scope.Define(stage, PRODUCTS)
    UsdGeom.Scope.Define(stage, VARIABLES)
    settings = UsdRender.Settings.Define(stage, SETTINGS)
    settings.CreateResolutionAttr(Gf.Vec2i(camera.width, camera.height))
    settings.CreatePixelAspectRatioAttr(camera.fy / camera.fx)
    settings.CreateRenderingColorSpaceAttr(Gf.ColorSpaceNames.LinearRec709)
    settings.CreateIncludedPurposesAttr([UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    products = [_product(stage, name, _variable(stage, name, kind)) for name, kind in outputs.items()]
    for name, lens in further.items():
        for output in outputs:
            products.append(_product(stage, _product_name(output, name), VARIABLES.AppendChild(output)))
            product = UsdRender.Product(stage.GetPrimAtPath(products[-1]))
            product.CreateResolutionAttr(Gf.Vec2i(lens.width, lens.height))
            product.CreatePixelAspectRatioAttr(lens.fy / lens.fx)
    settings.CreateProductsRel().SetTargets(products)
    return layer


def _product_name(output: str, camera: str) -> str:
    return f"{camera}_{output}"


def _variable(stage: Usd.Stage, name: str, kind: str) -> Sdf.Path:
    variable = UsdRender.Var.Define(stage, VARIABLES.AppendChild(name))
    variable.CreateDataTypeAttr(kind)
    variable.CreateSourceNameAttr(name)
    variable.CreateSourceTypeAttr(UsdRender.Tokens.raw)
    return variable.GetPath()


def _product(stage: Usd.Stage, name: str, variable: Sdf.Path) -> Sdf.Path:
    """Define a product of one variable: each label is a file of its own."""
    product = UsdRender.Product.Define(stage, PRODUCTS.AppendChild(name))
    product.CreateProductTypeAttr(UsdRender.Tokens.raster)
    product.CreateProductNameAttr(f"./{name}.exr")
    product.CreateOrderedVarsRel().SetTargets([variable])
    return product.GetPath()

"""Layers added to a written stage, such as given keypoints and a LiDAR that is mounted on the camera: prims of the root
layer refer to them before all their other references."""

from collections.abc import Mapping
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from spin_usd.geometry.frames import T_CAM_USDCAM, T_USDCAM_CAM
from spin_usd.geometry.transform import Transform
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.lidar import Lidar, RangeFinder
from spin_usd.stage.author.paths import CAMERA, TARGET
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import box, quatd, vec3d, vec3f_array
from spin_usd.stage.usd.layer_file import author_metadata, export, writing

FOLDER = "layers"
KEYPOINTS, LIDAR, RANGE_FINDER = Sdf.Path("/Keypoints"), Sdf.Path("/Lidar"), Sdf.Path("/RangeFinder")
"""The prims of the layers that are added."""


def add_layer(root: Path, layer: Sdf.Layer, file: str, prims: Mapping[Sdf.Path, Sdf.Path]) -> None:
    """Write `layer` as `file` beside the other layers of the stage at `root`, and let each of the root layer's
    `prims` refer to the prim of `layer` that it maps to.

    The layer is referenced, so a variant on the default prim beats it. Raises OutputError.
    """
    export(layer, root.parent / FOLDER / file)
    made = open_layer(root)
    for prim, source in prims.items():
        references = Sdf.CreatePrimInLayer(made, prim).referenceList.prependedItems
        references.insert(0, Sdf.Reference(f"./{FOLDER}/{file}", source))
    with writing(root):
        made.Save()


def add_keypoints(root: Path, keypoints: Keypoints) -> None:
    """Write `keypoints` over the stage at `root`, replacing the model's. Raises OutputError."""
    layer = keypoints_layer(keypoints, "The keypoints that were given, metres, body axes.")
    prim = TARGET.AppendChild(KEYPOINTS.name)
    add_layer(root, layer, "keypoints.usda", {prim: KEYPOINTS})
    made = open_layer(root)
    made.GetPrimAtPath(prim).specifier = Sdf.SpecifierDef
    stage = stage_on(made)
    stage.GetPrimAtPath(TARGET).GetRelationship(schema.TARGET_KEYPOINTS).SetTargets([prim])
    with writing(root):
        made.Save()


def keypoints_layer(keypoints: Keypoints, documentation: str) -> Sdf.Layer:
    """Make an anonymous layer whose prim KEYPOINTS has the `keypoints`, to stand below a target."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=KEYPOINTS.name, documentation=documentation)
    stage = stage_on(layer)
    author_keypoints(UsdGeom.Points.Define(stage, KEYPOINTS), keypoints)
    return layer


def author_keypoints(points: UsdGeom.Points, keypoints: Keypoints) -> None:
    """Author named points of a body, metres."""
    prim = points.GetPrim()
    points.CreatePointsAttr(vec3f_array(keypoints.points))
    if keypoints.names:
        points.CreateExtentAttr(box(keypoints.points))
    points.CreatePurposeAttr(UsdGeom.Tokens.guide)
    primvars = UsdGeom.PrimvarsAPI(prim)
    name = schema.KEYPOINT_NAME.removeprefix("primvars:")
    primvars.CreatePrimvar(name, Sdf.ValueTypeNames.StringArray, UsdGeom.Tokens.vertex).Set(list(keypoints.names))
    prim.ApplyAPI(schema.KEYPOINTS_API)
    prim.GetAttribute(schema.KEYPOINT_POSITIONS).Set(Vt.Vec3dArray([vec3d(point) for point in keypoints.points]))


def add_lidar(root: Path, lidar: Lidar, documentation: str) -> None:
    """Mount `lidar` on the camera of the stage at `root`, whose units are metres. Raises OutputError."""
    add_layer(root, lidar_layer(lidar, documentation), "lidar.usda", {CAMERA.AppendPath(LIDAR.name): LIDAR})


def add_range_finder(root: Path, finder: RangeFinder, documentation: str) -> None:
    """Mount the laser range finder on the camera of the stage at `root`. Raises OutputError."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=RANGE_FINDER.name, documentation=documentation)
    stage = stage_on(layer)
    prim = _mounted(stage, RANGE_FINDER, T_USDCAM_CAM @ finder.T_cam_finder @ T_CAM_USDCAM)
    prim.ApplyAPI(schema.RANGE_FINDER_API)
    prim.GetAttribute(schema.RANGE_FINDER_DIVERGENCE).Set(finder.divergence_deg)
    add_layer(root, layer, "range_finder.usda", {CAMERA.AppendPath(RANGE_FINDER.name): RANGE_FINDER})


def _mounted(stage: Usd.Stage, path: Sdf.Path, pose: Transform) -> Usd.Prim:
    """Define a prim that stands so below a camera."""
    xform = UsdGeom.Xform.Define(stage, path)
    xform.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(vec3d(pose.translation + 0.0))  # no negative zeros
    xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(quatd(pose.quaternion))
    return xform.GetPrim()


def lidar_layer(lidar: Lidar, documentation: str) -> Sdf.Layer:
    """Make an anonymous layer with the LiDAR, to stand below a camera."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=LIDAR.name, documentation=documentation)
    stage = stage_on(layer)
    prim = _mounted(stage, LIDAR, T_USDCAM_CAM @ lidar.T_cam_lidar)
    prim.ApplyAPI(schema.LIDAR_API)
    for field, name in schema.LIDAR.items():
        value = getattr(lidar, field)
        prim.GetAttribute(name).Set(Gf.Vec2d(*value) if isinstance(value, tuple) else value)
    return layer

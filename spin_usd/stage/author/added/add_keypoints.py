"""Keypoints that a user gives, written over an authored stage as a Points prim, in body axes and metres."""

from pathlib import Path

from pxr import Sdf, UsdGeom, Vt

from spin_usd.scene.source.keypoints import Keypoints
from spin_usd.stage.author.added_layer import add_layer
from spin_usd.stage.author.paths import TARGET
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import box, vec3d, vec3f_array
from spin_usd.stage.usd.layer_file import author_metadata, writing

FILE = "keypoints.usda"
NAME = "Keypoints"
PRIM = TARGET.AppendChild(NAME)


def add_keypoints(root: Path, keypoints: Keypoints) -> None:
    """Write `keypoints` over the stage at `root`, instead of those that its model has. Raises OutputError."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=NAME, documentation="The keypoints that were given, metres, body axes.")
    source = Sdf.Path.absoluteRootPath.AppendChild(NAME)
    stage = stage_on(layer)
    _author(UsdGeom.Points.Define(stage, source), keypoints)
    add_layer(root, layer, FILE, {PRIM: source})
    made = open_layer(root)
    made.GetPrimAtPath(PRIM).specifier = Sdf.SpecifierDef
    stage = stage_on(made)
    stage.GetPrimAtPath(TARGET).GetRelationship(schema.TARGET_KEYPOINTS).SetTargets([PRIM])
    with writing(root):
        made.Save()


def _author(points: UsdGeom.Points, keypoints: Keypoints) -> None:
    prim = points.GetPrim()
    points.CreatePointsAttr(vec3f_array(keypoints.points))
    points.CreateExtentAttr(box(keypoints.points))
    points.CreatePurposeAttr(UsdGeom.Tokens.guide)
    primvars = UsdGeom.PrimvarsAPI(prim)
    name = schema.KEYPOINT_NAME.removeprefix("primvars:")
    primvars.CreatePrimvar(name, Sdf.ValueTypeNames.StringArray, UsdGeom.Tokens.vertex).Set(list(keypoints.names))
    prim.ApplyAPI(schema.KEYPOINTS_API)
    prim.GetAttribute(schema.KEYPOINT_POSITIONS).Set(Vt.Vec3dArray([vec3d(point) for point in keypoints.points]))

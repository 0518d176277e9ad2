"""A layer with named keypoints: a Points prim, in body axes and metres, that a target refers to."""

from pxr import Sdf, UsdGeom, Vt

from spin_usd.scene.keypoints import Keypoints
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import box, vec3d, vec3f_array
from spin_usd.stage.usd.layer_file import author_metadata

PRIM = Sdf.Path("/Keypoints")


def keypoints_layer(keypoints: Keypoints, documentation: str) -> Sdf.Layer:
    """Make an anonymous layer whose prim PRIM has the `keypoints`, to stand below a target."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=PRIM.name, documentation=documentation)
    stage = stage_on(layer)
    _author(UsdGeom.Points.Define(stage, PRIM), keypoints)
    return layer


def _author(points: UsdGeom.Points, keypoints: Keypoints) -> None:
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

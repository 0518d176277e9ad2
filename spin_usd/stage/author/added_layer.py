"""A layer added to a written stage: prims of the root layer refer to it before all their other references."""

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf, UsdGeom, Vt

from spin_usd.scene.keypoints import Keypoints
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import box, vec3d, vec3f_array
from spin_usd.stage.usd.layer_file import author_metadata, export, writing

FOLDER = "layers"
PRIM = Sdf.Path("/Keypoints")


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

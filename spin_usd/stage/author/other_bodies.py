"""Bodies beside the first target, written over an authored stage: other targets, and occluders fixed to the camera."""

from pathlib import Path

import numpy as np
from pxr import Kind, Sdf, Usd, UsdGeom

from spin_usd.basics.unique_names import UniqueNames
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.geometry.rotation import matrices_from_quaternions, quaternion_from_matrix
from spin_usd.scene.poses import PoseList
from spin_usd.stage.author.paths import CAMERA, WORLD
from spin_usd.stage.author.poses_layer import author_pose_samples, author_poses, by_short_ways
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.author.target_prim import MODEL, asset_reference, author_model, author_target
from spin_usd.stage.author.variant_sets import LAYER as VARIANT_SETS_LAYER
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.usd.conversion import quatd, vec3d
from spin_usd.stage.usd.layer_file import author_metadata, export, writing

FOLDER = "layers"
VARIANT_SETS = f"./{FOLDER}/{VARIANT_SETS_LAYER}"


def add_target(root: Path, asset: TargetAsset, poses: PoseList) -> None:
    """Write another target over the stage at `root`: `asset`, which lies in its folder, with a pose for each picture.
    Raises OutputError."""
    made = open_layer(root)
    stage = stage_on(made)
    path = _free_path(stage, WORLD, asset.name)
    author_target(stage, path, asset, _reference(asset, root.parent, up="."))
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    author_metadata(layer, default_prim=WORLD.name, frames=len(poses))
    author_poses(Sdf.CreatePrimInLayer(layer, path), poses)
    export(layer, root.parent / FOLDER / f"{_stem(path)}_poses.usdc")
    # USD lists a weaker layer's prims before a stronger one's, and their order gives targets their ids.
    strongest = made.subLayerPaths.index(VARIANT_SETS) + 1
    made.subLayerPaths.insert(strongest, f"./{FOLDER}/{_stem(path)}_poses.usdc")
    with writing(root):
        made.Save()


def add_occluder(root: Path, asset: TargetAsset, poses: PoseList | None) -> None:
    """Write `asset`, in the stage's folder, below the camera of the stage at `root`, in its own layer: in the camera's
    axes if `poses` is None, at its one pose, or at a pose for each picture. Raises OutputError."""
    made = open_layer(root)
    stage = stage_on(made)
    path = _free_path(stage, CAMERA, asset.name)
    suffix = ".usdc" if poses and len(poses) > 1 else ".usda"
    layer = Sdf.Layer.CreateAnonymous(suffix)
    documentation = f"{asset.name}, fixed to the camera: it occludes, shades and reflects, but is not a target."
    author_metadata(layer, default_prim=path.name, documentation=documentation, frames=len(poses or (0,)))
    _author_occluder(layer, asset, poses, _reference(asset, root.parent, up=".."))
    export(layer, root.parent / FOLDER / f"{_stem(path)}{suffix}")
    stage.DefinePrim(path).GetReferences().AddReference(f"./{FOLDER}/{_stem(path)}{suffix}")
    with writing(root):
        made.Save()


def _author_occluder(layer: Sdf.Layer, asset: TargetAsset, poses: PoseList | None, reference: Sdf.Reference) -> None:
    stage = stage_on(layer)
    prim = UsdGeom.Xform.Define(stage, Sdf.Path.absoluteRootPath.AppendChild(layer.defaultPrim)).GetPrim()
    model = author_model(stage, prim.GetPath().AppendChild(MODEL), asset, reference)
    Usd.ModelAPI(model).SetKind(Kind.Tokens.subcomponent)  # a camera is not a group of models
    q_cam_body = poses.q_cam_body if poses else np.array([[1.0, 0, 0, 0]])
    t_cam_body = poses.t_cam_body if poses else np.zeros((1, 3))
    turns = T_USDCAM_CAM.rotation @ matrices_from_quaternions(q_cam_body)
    q = by_short_ways(np.array([quaternion_from_matrix(turn) for turn in turns]))
    t = T_USDCAM_CAM.points(t_cam_body) + 0.0  # no negative zeros
    if len(q) > 1:
        author_pose_samples(layer.GetPrimAtPath(prim.GetPath()), q, t)
        return
    xformable = UsdGeom.Xformable(prim)
    xformable.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(vec3d(t[0]))
    xformable.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(quatd(q[0]))


def _free_path(stage: Usd.Stage, parent: Sdf.Path, name: str) -> Sdf.Path:
    """Return the path of a child of `parent` that there is not yet, called after `name`."""
    taken = stage.GetPrimAtPath(parent).GetAllChildrenNames()
    return parent.AppendChild(UniqueNames(cased=True, taken=taken).give(name[:1].upper() + name[1:]))


def _stem(path: Sdf.Path) -> str:
    """Return the name of a body's layers, without an ending."""
    return str(path.name).lower()


def _reference(asset: TargetAsset, folder: Path, *, up: str) -> Sdf.Reference:
    """Return the reference to the asset, which lies in the stage's `folder`; `up` leads there from the layer that has
    it."""
    return asset_reference(asset, f"{up}/{asset.file.relative_to(folder).as_posix()}")

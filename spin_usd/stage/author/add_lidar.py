"""The layer of a LiDAR that is mounted on the camera."""

from pathlib import Path

from pxr import Gf, Sdf, UsdGeom

from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.scene.lidar import Lidar
from spin_usd.stage.author.added_layer import add_layer
from spin_usd.stage.author.paths import CAMERA
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import quatd, vec3d
from spin_usd.stage.usd.layer_file import author_metadata

PRIM = Sdf.Path("/Lidar")
FILE = "lidar.usda"


def add_lidar(root: Path, lidar: Lidar, documentation: str) -> None:
    """Mount `lidar` on the camera of the stage at `root`, whose units are metres. Raises OutputError."""
    add_layer(root, lidar_layer(lidar, documentation), FILE, {CAMERA.AppendPath(PRIM.name): PRIM})


def lidar_layer(lidar: Lidar, documentation: str) -> Sdf.Layer:
    """Make an anonymous layer with the LiDAR, to stand below a camera."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=PRIM.name, documentation=documentation)
    stage = stage_on(layer)
    xform = UsdGeom.Xform.Define(stage, PRIM)
    pose = T_USDCAM_CAM @ lidar.T_cam_lidar
    xform.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(vec3d(pose.translation + 0.0))  # no negative zeros
    xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(quatd(pose.quaternion))
    prim = xform.GetPrim()
    prim.ApplyAPI(schema.LIDAR_API)
    for field, name in schema.LIDAR.items():
        value = getattr(lidar, field)
        prim.GetAttribute(name).Set(Gf.Vec2d(*value) if isinstance(value, tuple) else value)
    return layer

"""A target as a stage would have it, read before there is a stage."""

from pxr import Sdf, Usd

from spin_usd.scene.target import Target
from spin_usd.stage.author.target.target_asset import TargetAsset
from spin_usd.stage.author.target.target_prim import asset_reference, author_target
from spin_usd.stage.composition.images import Images
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.read.target.target import TargetReader
from spin_usd.stage.usd.layer_file import author_metadata
from spin_usd.stage.usd.notes import Notes

PRIM = Sdf.Path("/Target")


def composed_target(asset: TargetAsset) -> Target:
    """Read the target of the `asset`, body axes, metres, with its own keypoints. Raises StageError, UnsupportedError
    and GeometryError for what a render would refuse too."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=PRIM.name)
    stage = stage_on(layer)
    author_target(stage, PRIM, asset, asset_reference(asset, str(asset.file)))
    time = Usd.TimeCode.EarliestTime()
    prim = stage.GetPrimAtPath(PRIM)
    return TargetReader(prim=prim, time=time, group_of=lambda _: 0, images=Images(), notes=Notes()).read(1.0)

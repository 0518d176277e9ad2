"""A target as a stage would have it, read before there is a stage."""

from pathlib import Path

from pxr import Sdf, Usd

from spin_usd.scene.target import Target
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.author.target_prim import asset_reference, author_target
from spin_usd.stage.composition.images import Images
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.read.target.body_parts import BodyParts
from spin_usd.stage.read.target.target import TargetReader
from spin_usd.stage.usd.layer_file import author_metadata, writing
from spin_usd.stage.usd.root_metadata import Notes

PRIM = Sdf.Path("/Target")
FILE = "target_alone.usda"


def composed_target(asset: TargetAsset, folder: Path) -> Target:
    """Read the target of the `asset`, which lies in `folder`, where a stage of it alone is written: body axes, metres,
    with its own keypoints. Raises StageError, UnsupportedError and GeometryError for what a render would refuse too."""
    with writing(folder / FILE):
        layer = Sdf.Layer.CreateNew(str(folder / FILE))  # a stage's images must lie in its root layer's folder
    author_metadata(layer, default_prim=PRIM.name)
    stage = stage_on(layer)
    author_target(stage, PRIM, asset, asset_reference(asset, f"./{asset.file.relative_to(folder).as_posix()}"))
    prim, time = stage.GetPrimAtPath(PRIM), Usd.TimeCode.EarliestTime()
    reader = TargetReader(
        prim=prim,
        parts=BodyParts().add(prim),
        time=time,
        group_of=lambda _: 0,
        images=Images(check=False),
        notes=Notes(),
    )
    return reader.read(1.0)

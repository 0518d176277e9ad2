"""Keypoints that a user gives, written over an authored stage as a Points prim, in body axes and metres."""

from pathlib import Path

from pxr import Sdf

from spin_usd.scene.keypoints import Keypoints
from spin_usd.stage.author.added_layer import PRIM as SOURCE
from spin_usd.stage.author.added_layer import add_layer, keypoints_layer
from spin_usd.stage.author.paths import TARGET
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import writing

FILE = "keypoints.usda"
PRIM = TARGET.AppendChild(SOURCE.name)


def add_keypoints(root: Path, keypoints: Keypoints) -> None:
    """Write `keypoints` over the stage at `root`, instead of those that its model has. Raises OutputError."""
    layer = keypoints_layer(keypoints, "The keypoints that were given, metres, body axes.")
    add_layer(root, layer, FILE, {PRIM: SOURCE})
    made = open_layer(root)
    made.GetPrimAtPath(PRIM).specifier = Sdf.SpecifierDef
    stage = stage_on(made)
    stage.GetPrimAtPath(TARGET).GetRelationship(schema.TARGET_KEYPOINTS).SetTargets([PRIM])
    with writing(root):
        made.Save()

"""Several targets that the pictures of a stage show in turn: each is visible in its own alone."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from pxr import Sdf, UsdGeom

from spin_usd.scene.poses import PoseList
from spin_usd.stage.author.other_bodies import FOLDER, VARIANT_SETS
from spin_usd.stage.author.paths import MODEL, TARGET, WORLD
from spin_usd.stage.author.poses_layer import author_pose_samples, target_in_world
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.author.target_prim import asset_reference, author_target
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.usd.conversion import identifier
from spin_usd.stage.usd.layer_file import author_metadata, export, layer_at, writing

LAYER = "turns.usdc"


def add_targets_in_turn(
    root: Path,
    assets: Sequence[TargetAsset],
    poses: PoseList,
    shown: Sequence[str],
    selections: Mapping[str, str],
) -> None:
    """Write the `assets`, root prims of one layer in its folder, over the stage at `root`, whose target is the first of
    them: in each picture the one that is `shown`, by its name, is visible, at the picture's pose. The variants of
    `selections`, which the first has selected, are selected in all. Raises OutputError."""
    made = open_layer(root)
    stage = stage_on(made)
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    author_metadata(layer, default_prim=WORLD.name, frames=len(poses))
    q, t = target_in_world(poses)
    pictures = _pictures(shown)
    _select(assets, selections)
    paths = []
    for number, asset in enumerate(assets):
        path = WORLD.AppendChild(f"Target_{identifier(asset.name)}") if number else TARGET
        if number:
            paths.append(path)
            reference = f"./{asset.file.relative_to(root.parent).as_posix()}"
            author_target(stage, path, asset, asset_reference(asset, reference))
        with Sdf.ChangeBlock():
            over = Sdf.CreatePrimInLayer(layer, path)
            own = pictures[asset.name]
            if number:
                author_pose_samples(over, q[own], t[own], own)
            _author_visibility(over, own, len(poses))
    export(layer, root.parent / FOLDER / LAYER)
    _share_selections(root.parent / VARIANT_SETS, paths)
    made.subLayerPaths.insert(made.subLayerPaths.index(VARIANT_SETS) + 1, f"./{FOLDER}/{LAYER}")
    with writing(root):
        made.Save()


def _select(assets: Sequence[TargetAsset], selections: Mapping[str, str]) -> None:
    """Select variants in the assets themselves, so that a variant of the stage may select others."""
    if not selections:
        return
    layer = layer_at(assets[0].file)
    for each in assets:
        assert each.prim
        layer.GetPrimAtPath(each.prim).variantSelections.update(dict(selections))
    with writing(assets[0].file):
        layer.Save()


def _share_selections(file: Path, paths: Sequence[Sdf.Path]) -> None:
    """Have the variants of /World in the layer at `file` select for the targets at `paths` what they do for the
    first."""
    layer = layer_at(file)
    for variants in layer.GetPrimAtPath(WORLD).variantSets.values():
        for variant in variants.variants.values():
            within = variant.primSpec.path
            first = layer.GetPrimAtPath(MODEL.ReplacePrefix(WORLD, within))
            for path in paths if first else ():
                model = Sdf.CreatePrimInLayer(layer, path.AppendChild(MODEL.name).ReplacePrefix(WORLD, within))
                model.variantSelections.update(dict(first.variantSelections))
    with writing(file):
        layer.Save()


def _pictures(shown: Sequence[str]) -> Mapping[str, list[int]]:
    found: dict[str, list[int]] = {}
    for place, name in enumerate(shown):
        found.setdefault(name, []).append(place)
    return found


def _author_visibility(prim: Sdf.PrimSpec, own: Sequence[int], count: int) -> None:
    """Show a prim at its `own` time codes alone; a sample holds until the next."""
    Sdf.AttributeSpec(prim, UsdGeom.Tokens.visibility, Sdf.ValueTypeNames.Token)
    path = prim.path.AppendProperty(UsdGeom.Tokens.visibility)
    seen = np.zeros(count, bool)
    seen[list(own)] = True
    changes = [0, *(np.flatnonzero(seen[1:] != seen[:-1]) + 1).tolist()]
    for place in changes:
        value = UsdGeom.Tokens.inherited if seen[place] else UsdGeom.Tokens.invisible
        prim.layer.SetTimeSample(path, float(place), value)

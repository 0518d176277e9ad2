"""A target's prim in a stage, and below it the model, which refers to the target's asset.

A target alone is read as a stage would have it, before there is a stage.
"""

from pathlib import Path

from pxr import Gf, Kind, Sdf, Usd, UsdGeom

from spin_usd.scene.target import Target
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.composition.images import Images
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.read.bodies.body_parts import BodyParts
from spin_usd.stage.read.bodies.find_bodies import find_targets
from spin_usd.stage.read.bodies.target import TargetReader
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import author_metadata, writing
from spin_usd.stage.usd.root_metadata import Notes

MODEL = "Model"
ALONE = Sdf.Path("/Target")
ALONE_FILE = "target_alone.usda"


def author_target(stage: Usd.Stage, path: Sdf.Path, target: TargetAsset, reference: Sdf.Reference) -> None:
    """Author the target's prim at `path`, and its model below with this `reference` to the target's asset."""
    prim = UsdGeom.Xform.Define(stage, path).GetPrim()
    Usd.ModelAPI(prim).SetKind(Kind.Tokens.group)
    prim.ApplyAPI(schema.TARGET_API)
    prim.GetAttribute(schema.TARGET_NAME).Set(target.name)
    model = path.AppendChild(MODEL)
    if target.keypoints:
        prim.GetRelationship(schema.TARGET_KEYPOINTS).SetTargets([model.AppendPath(target.keypoints)])
    author_model(stage, model, target, reference)


def author_model(stage: Usd.Stage, path: Sdf.Path, target: TargetAsset, reference: Sdf.Reference) -> Usd.Prim:
    """Author the model at `path`, in metres, and return its prim, which is not the target itself."""
    # Without a type the asset's own counts, which may be Mesh; one without a transform needs an Xform to be scaled.
    model = stage.DefinePrim(path, "" if target.xformable else "Xform")
    model.GetReferences().AddReference(reference)
    if model.HasAPI(schema.TARGET_API):  # an asset made for spin_usd; here its parent is the target
        model.RemoveAPI(schema.TARGET_API)
    if not target.has_kind:
        Usd.ModelAPI(model).SetKind(Kind.Tokens.component)
    if target.metres_per_unit != 1:
        scale = model.CreateAttribute(schema.UNITS_OP, Sdf.ValueTypeNames.Double3, custom=False)
        scale.Set(Gf.Vec3d(target.metres_per_unit))
        # Outermost: the asset's own operations stay in its own units.
        UsdGeom.Xformable(model).CreateXformOpOrderAttr([schema.UNITS_OP, *target.order])
    return model


def keep_transparent(root: Path) -> None:
    """Keep surfaces of opacity 0 in the labels of all targets of the stage at `root`. Raises OutputError."""
    layer = open_layer(root)
    stage = stage_on(layer)
    for prim in find_targets(stage):
        prim.GetAttribute(schema.TARGET_KEEP_TRANSPARENT).Set(True)
    with writing(root):
        layer.Save()


def asset_reference(target: TargetAsset, asset_path: str) -> Sdf.Reference:
    """Return the reference to the target's asset, whose layer is at `asset_path`."""
    return Sdf.Reference(asset_path, Sdf.Path(target.prim) if target.prim else Sdf.Path())


def composed_target(asset: TargetAsset, folder: Path) -> Target:
    """Read the target of the `asset` in `folder`, where a stage of it alone is written: body axes, metres, with its own
    keypoints. Raises StageError, UnsupportedError and GeometryError like a render."""
    with writing(folder / ALONE_FILE):
        layer = Sdf.Layer.CreateNew(str(folder / ALONE_FILE))  # a stage's images must lie in its root layer's folder
    author_metadata(layer, default_prim=ALONE.name)
    stage = stage_on(layer)
    author_target(stage, ALONE, asset, asset_reference(asset, f"./{asset.file.relative_to(folder).as_posix()}"))
    prim, time = stage.GetPrimAtPath(ALONE), Usd.TimeCode.EarliestTime()
    reader = TargetReader(
        prim=prim,
        parts=BodyParts().add(prim),
        time=time,
        group_of=lambda _: 0,
        images=Images(check=False),
        notes=Notes(),
    )
    return reader.read(1.0)

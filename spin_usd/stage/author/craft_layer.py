"""Craft from seeds as USD: one layer with a prim for each, which refer to materials of the library beside it.

Each has the looks matt and reflective, keypoints, labels of our own finer classes, the hinges of driven parts, and its
symmetries.
"""

from collections.abc import Sequence
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

from spin_usd.scene.asset import Hinge, MeshAsset
from spin_usd.stage.author.added_layer import author_keypoints
from spin_usd.stage.author.from_mesh_file import author_geometry, author_interface, bind_faces
from spin_usd.stage.author.looks import LOOK, MATERIALS, MATT, REFLECTIVE
from spin_usd.stage.author.material_library import SURFACE, author_matt, copy_material
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.composition.open_stage import silenced
from spin_usd.stage.usd.conversion import identifier, quatd
from spin_usd.stage.usd.layer_file import author_metadata, export

CUSTOM = "spin"
"""The dictionary in the customData of a craft's root; its `symmetries` are the rotations, as quaternions, that leave
the craft as it is."""


def write_crafts(crafts: Sequence[MeshAsset], file: Path, documentation: str) -> None:
    """Write craft as the root prims of a layer, of which the first is the default, and the materials that they have
    into the folder `materials` beside it. Raises OutputError."""
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    author_metadata(layer, default_prim=crafts[0].name, documentation=documentation)
    for craft in crafts:
        path = Sdf.Path.absoluteRootPath.AppendChild(craft.name)
        Sdf.CopySpec(_craft_layer(craft, path), path, layer, path)
    for name in sorted({each.constants.path for craft in crafts for each in craft.materials}):
        copy_material(name, file.parent / "materials")
    export(layer, file)


def _craft_layer(craft: MeshAsset, root: Sdf.Path) -> Sdf.Layer:
    """Make an anonymous layer with one craft."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=root.name)
    paths = [root.AppendChild(identifier(part.name)) for part in craft.parts]
    author_geometry(layer, root, paths, craft)
    author_interface(stage_on(layer), root.name, craft, craft.name)
    _author_looks(layer.GetPrimAtPath(root), [each.constants.path for each in craft.materials])
    with silenced():  # until it is written, its materials are not beside it
        stage = stage_on(layer)
    made = {
        i: UsdShade.Material(stage.GetPrimAtPath(root.AppendPath(f"{MATERIALS}/{each.constants.path}")))
        for i, each in enumerate(craft.materials)
    }
    for path, part in zip(paths, craft.parts, strict=True):
        bind_faces(stage.GetPrimAtPath(path), part.face_material, made)
    if craft.keypoints:
        author_keypoints(UsdGeom.Points.Define(stage, root.AppendChild("Keypoints")), craft.keypoints)
    for hinge in craft.hinges:
        _author_hinge(UsdPhysics.RevoluteJoint.Define(stage, root.AppendChild(f"{hinge.part}Hinge")), hinge)
    prim: Usd.Prim = stage.GetPrimAtPath(root)
    if craft.symmetries:
        prim.SetCustomDataByKey(f"{CUSTOM}:symmetries", Vt.QuatdArray([quatd(each) for each in craft.symmetries]))
    return layer


def _author_looks(root: Sdf.PrimSpec, materials: Sequence[str]) -> None:
    """Author the looks, in which materials of the same names are the library's, or these without reflections."""
    root.variantSetNameList.Prepend(LOOK)
    root.variantSelections[LOOK] = REFLECTIVE
    for look in (MATT, REFLECTIVE):
        variant = Sdf.CreateVariantInLayer(root.layer, root.path, LOOK, look).primSpec
        scope = Sdf.PrimSpec(variant, MATERIALS, Sdf.SpecifierDef, "Scope")
        for name in materials:
            material = Sdf.PrimSpec(scope, name, Sdf.SpecifierDef, "Material")
            material.referenceList.Prepend(Sdf.Reference(f"./materials/{name}.usda"))
            if look == MATT:
                author_matt(Sdf.PrimSpec(material, SURFACE, Sdf.SpecifierOver), name)


def _author_hinge(joint: UsdPhysics.RevoluteJoint, hinge: Hinge) -> None:
    """Join the part to the whole, about an axis of the body; parts have the body's axes."""
    root = joint.GetPath().GetParentPath()
    joint.CreateBody0Rel().SetTargets([root])
    part = root.AppendChild(identifier(hinge.part))
    UsdPhysics.RigidBodyAPI.Apply(joint.GetPrim().GetStage().GetPrimAtPath(part))
    joint.CreateBody1Rel().SetTargets([part])
    joint.CreateAxisAttr(hinge.axis)
    at = Gf.Vec3f(*(float(each) for each in hinge.at))
    joint.CreateLocalPos0Attr(at)
    joint.CreateLocalPos1Attr(at)

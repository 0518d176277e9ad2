"""Craft from seeds as USD: what USD's own readers find in the layer, and the same bytes twice."""

from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdPhysics, UsdShade

from spin_usd.craft.craft import KINDS
from spin_usd.craft.equipment import EQUIPMENT
from spin_usd.craft.make_craft import CraftChoice, make_craft
from spin_usd.craft.model import model_of
from spin_usd.stage.author.craft_layer import write_crafts
from spin_usd.stage.check.check_stage import validator_findings

DRIVEN = CraftChoice(seed=12, family="box", wings=2, driven=True)
PLAIN = CraftChoice(seed=4, family="cylinder", wings=0, counts=dict.fromkeys(EQUIPMENT, 0))


def written(folder: Path, *choices: CraftChoice) -> Usd.Stage:
    file = folder / "crafts.usdc"
    write_crafts([model_of(make_craft(each)) for each in choices], file, "Two craft.")
    return Usd.Stage.Open(str(file))


def test_meshes_have_the_points_classes_and_materials_of_the_parts(tmp_path: Path) -> None:
    stage, craft = written(tmp_path, DRIVEN), make_craft(DRIVEN)
    assert not [*validator_findings(stage)]
    for part in craft.parts:
        prim = stage.GetPrimAtPath(f"/craft_12/{part.name}")
        points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get())
        np.testing.assert_array_equal(points, part.points.astype(np.float32))
        assert list(prim.GetAttribute("semantics:labels:class").Get()) == [KINDS[part.kind]]
        assert list(prim.GetAttribute("semantics:labels:component").Get()) == [part.kind]
        surfaces = [each for each in prim.GetChildren() if each.IsA(UsdGeom.Subset)] or [prim]
        bound = {UsdShade.MaterialBindingAPI(each).ComputeBoundMaterial()[0].GetPrim().GetName() for each in surfaces}
        assert bound == {name for solid in part.solids for name in solid.materials}


def test_both_looks_have_the_same_materials_and_only_one_reflects(tmp_path: Path) -> None:
    stage = written(tmp_path, DRIVEN)
    root = stage.GetDefaultPrim()
    metallic = {}
    for look in ("matt", "reflective"):
        root.GetVariantSet("look").SetVariantSelection(look)
        metallic[look] = {
            prim.GetParent().GetName(): UsdShade.Shader(prim).GetInput("metallic").GetAttr()
            for prim in stage.Traverse()
            if prim.GetName() == "Surface"
        }
        assert all(prim.IsValid() for prim in metallic[look].values())
    assert metallic["matt"].keys() == metallic["reflective"].keys()
    root.GetVariantSet("look").SetVariantSelection("matt")
    assert {each.Get() for each in metallic["matt"].values()} == {0.0}


def test_keypoints_hinges_and_symmetries_are_stated(tmp_path: Path) -> None:
    stage = written(tmp_path, DRIVEN, PLAIN)
    craft = make_craft(DRIVEN)
    keypoints = UsdGeom.Points(stage.GetPrimAtPath("/craft_12/Keypoints"))
    assert len(keypoints.GetPointsAttr().Get()) == len(craft.keypoints)
    joints = [UsdPhysics.RevoluteJoint(each) for each in stage.Traverse() if each.IsA(UsdPhysics.RevoluteJoint)]
    driven = [part for part in craft.parts if part.joint]
    assert {str(each.GetBody1Rel().GetTargets()[0]) for each in joints} == {f"/craft_12/{p.name}" for p in driven}
    assert {each.GetAxisAttr().Get() for each in joints} == {"Y"}
    stated = stage.GetPrimAtPath("/craft_4").GetCustomDataByKey("spin:symmetries")
    assert len(stated) == len(make_craft(PLAIN).symmetries) > 0


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in "ab"]
    for folder in folders:
        folder.mkdir()
        written(folder, DRIVEN, PLAIN)
    one, other = ({path.relative_to(f): path.read_bytes() for path in f.rglob("*.*")} for f in folders)
    assert one == other
    assert len(one) > 3

"""Prims that are left out of a target: the ones that a pattern matches, and levels of detail beside a finer one."""

from pathlib import Path

import pytest
from pxr import Usd, UsdGeom

from spin_usd.errors import InputError
from spin_usd.stage.author.leave_out import leave_out
from spin_usd.stage.author.target_asset import describe


def written(folder: Path, *shapes: tuple[str, float]) -> Path:
    """A target of cubes at these paths, which may have a group, of these sizes."""
    file = folder / "craft.usda"
    stage = Usd.Stage.CreateNew(str(file))
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/Craft").GetPrim())
    for path, size in shapes:
        UsdGeom.Cube.Define(stage, f"/Craft/{path}").CreateSizeAttr(size)
    stage.GetRootLayer().Save()
    return file


def shown(file: Path) -> list[str]:
    stage = Usd.Stage.Open(str(file))
    prims = Usd.PrimRange(stage.GetDefaultPrim(), Usd.TraverseInstanceProxies())
    return [str(prim.GetPath()).removeprefix("/Craft/") for prim in prims if prim.IsA(UsdGeom.Gprim)]


def left(file: Path, *patterns: str) -> tuple[list[str], tuple[str, ...]]:
    asset = leave_out(describe(file, "craft"), patterns, file)
    return shown(file), asset.notes


@pytest.mark.parametrize(
    ("names", "kept"),
    [
        (["body_LOD0", "body_LOD1", "body_LOD2"], ["body_LOD0"]),
        (["LOD1/body", "LOD2/body", "LOD2/panel"], ["LOD1/body"]),
        (["bodyLOD0", "bodyLOD3", "panel_lod_1"], ["bodyLOD0", "panel_lod_1"]),
        (["Explode1", "Explode2", "melod1", "melod2"], ["Explode1", "Explode2", "melod1", "melod2"]),
        (["a_LOD1_x", "b_LOD2_x"], ["a_LOD1_x", "b_LOD2_x"]),
    ],
)
def test_the_finest_level_of_each_name_is_kept(tmp_path: Path, names: list[str], kept: list[str]) -> None:
    file = written(tmp_path, *((name, 1 + n) for n, name in enumerate(names)))
    found, notes = left(file)
    assert found == kept
    assert len(notes) == (len(kept) < len(names))


def test_patterns_come_first_and_match_groups(tmp_path: Path) -> None:
    file = written(tmp_path, ("body_LOD0", 1), ("body_LOD1", 2), ("ground/plane", 9), ("keel", 3))
    found, notes = left(file, "*lod0", "Ground")
    assert found == ["body_LOD1", "keel"]
    assert notes == ("2 prims left out, as given",)


def test_a_prim_of_an_instance_is_left_out_of_that_instance_alone(tmp_path: Path) -> None:
    file = written(tmp_path, ("a/panel", 1), ("a/rod", 2))
    stage = Usd.Stage.Open(str(file))
    for name in ("b", "c"):
        prim = stage.DefinePrim(f"/Craft/{name}")
        prim.GetReferences().AddInternalReference("/Craft/a")
        prim.SetInstanceable(True)
    stage.GetRootLayer().Save()
    found, _ = left(file, "b")
    assert found == ["a/panel", "a/rod", "c/panel", "c/rod"]
    found, _ = left(file, "rod")
    assert found == ["a/panel", "c/panel"]


def test_patterns_of_nothing_and_of_everything_are_refused(tmp_path: Path) -> None:
    file = written(tmp_path, ("body", 1), ("rod", 2))
    with pytest.raises(InputError, match="'wing' matches no prim of the target; its prims are body, rod"):
        left(file, "wing")
    with pytest.raises(InputError, match="leaves nothing of the target"):
        left(file, "body", "rod")


def test_two_shapes_of_one_box_are_noted_and_kept(tmp_path: Path) -> None:
    file = written(tmp_path, ("fine", 2), ("coarse", 1.999), ("rod", 1))
    found, (note,) = left(file)
    assert found == ["fine", "coarse", "rod"]
    assert note.startswith("fine and coarse fill the same box")

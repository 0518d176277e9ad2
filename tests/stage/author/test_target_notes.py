"""What is said of a target that moves by itself, or that other programs show by a stand-in."""

from pathlib import Path

import pytest
from pxr import Usd

from spin_usd.stage.author.source_bounds import target_notes
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.composition.open_stage import open_stage

PANEL = """#usda 1.0
(
    defaultPrim = "Panel"
    timeCodesPerSecond = 12
)
def Xform "Panel"
{
    def Cube "Box"
    {
        float xformOp:rotateX.timeSamples = {
            1: 0,
            3: 90,
        }
        uniform token[] xformOpOrder = ["xformOp:rotateX"]
    }
}
"""
CARDS = """def Xform "Craft" (
    kind = "{kind}"
    prepend apiSchemas = ["GeomModelAPI"]
)
{{
    uniform token model:drawMode = "cards"
    {apply}
    def Cube "Box" {{}}
}}"""


def notes_of(path: Path) -> tuple[str, ...]:
    return target_notes(open_stage(path))


def modelled(path):
    """The stage with its world and target as groups, so that USD sees a model below them."""
    stage = Usd.Stage.Open(str(path))
    for place, kind in (("/World", "assembly"), ("/World/Target", "group")):
        Usd.ModelAPI(stage.GetPrimAtPath(place)).SetKind(kind)
    stage.GetRootLayer().Save()
    return path


def test_a_target_that_moves_is_told_in_the_stages_own_time_codes(make_stage, tmp_path) -> None:
    """The panel's 12 time codes a second are 24 of the stage's: its samples lie at 2 and 6 there."""
    (tmp_path / "panel.usda").write_text(PANEL)
    metadata = "metersPerUnit = 1\ntimeCodesPerSecond = 24\nstartTimeCode = 0\nendTimeCode = 7"
    path = make_stage('def "Panel" (\nprepend references = @./panel.usda@\n) {}', metadata=metadata)
    assert notes_of(path) == (
        "the target moves by itself between the stage's time codes 2 and 6, where picture i is time code i; 3 of 8 "
        "pictures lie outside, and show it as it is at the nearer end",
    )


def test_a_target_that_only_its_poses_move_is_not(make_stage) -> None:
    pose = "double3 xformOp:translate.timeSamples = {\n0: (0, 0, -9),\n1: (0, 0, -10),\n}\n"
    assert notes_of(make_stage(pose=f'{pose}uniform token[] xformOpOrder = ["xformOp:translate"]')) == ()


def draw_modes(path):
    return [each.where for each in check_stage(path) if each.code == "draw-mode"]


def test_a_stand_in_is_told_by_author_and_check(make_stage) -> None:
    path = modelled(make_stage(CARDS.format(kind="component", apply="")))
    said = "/World/Target/Craft asks to be shown as cards; its geometry is rendered instead"
    assert notes_of(path) == (said,)
    assert draw_modes(path) == ["/World/Target/Craft"]


def test_a_group_has_a_stand_in_only_where_it_says_so(make_stage) -> None:
    silent = modelled(make_stage(CARDS.format(kind="group", apply=""), name="silent.usda"))
    applied = modelled(make_stage(CARDS.format(kind="group", apply="uniform bool model:applyDrawMode = 1")))
    assert (notes_of(silent), draw_modes(silent)) == ((), [])
    assert len(notes_of(applied)) == len(draw_modes(applied)) == 1


@pytest.mark.parametrize(("scheme", "told"), [("", True), ('uniform token subdivisionScheme = "catmullClark"', False)])
def test_normals_that_the_default_scheme_ignores_are_reported(make_stage, scheme, told) -> None:
    mesh = f"""def Mesh "Fin"
    {{
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)]
        {scheme}
    }}"""
    notes = notes_of(make_stage(mesh))
    assert bool(notes) == told
    assert all(note.startswith("/World/Target/Fin has normals and no subdivisionScheme") for note in notes)

"""Rules of check on several bodies: what is wrong with any of them is found, and what may be meant is not."""

from spin_usd.renderers.embree.face_findings import face_findings
from spin_usd.stage.check.check_stage import check_stage

SECOND = """
def Xform "Second" (prepend apiSchemas = ["SpinTargetAPI"])
{{
    double3 xformOp:translate.timeSamples = {{
        0: {first},
        1: {last},
    }}
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Sphere "Ball" (prepend apiSchemas = ["SemanticsLabelsAPI:class"])
    {{
        token[] semantics:labels:class = ["ball"]
    }}
}}
"""
TWO_FRAMES = "metersPerUnit = 1\nstartTimeCode = 0\nendTimeCode = 1"


def found_at(stage, where):
    return [(each.code, each.severity) for each in check_stage(stage) if each.where == where]


def test_a_second_target_that_no_picture_shows_is_an_error(make_stage) -> None:
    stage = make_stage(metadata=TWO_FRAMES, world=SECOND.format(first=(0, 0, 20), last=(0, 0, 30)))
    assert found_at(stage, "/World/Second") == [("target-behind", "error")]


def test_a_second_target_that_leaves_the_frame_is_none(make_stage) -> None:
    stage = make_stage(metadata=TWO_FRAMES, world=SECOND.format(first=(0, 0, -12), last=(90, 0, -12)))
    assert found_at(stage, "/World/Second") == []


def test_faces_that_lie_in_one_another_are_found_in_an_occluder(make_stage) -> None:
    stage = make_stage(world='def Xform "Plates"\n{\ndef Cube "A" {}\ndef Cube "B" {}\n}')
    (finding,) = (each for each in check_stage(stage, target_rule=face_findings) if each.code == "faces-coincident")
    assert "/World/Plates/A with /World/Plates/B" in finding.message

"""Variants share the poses that they do not change, and no others."""

import pytest
from pxr import Sdf, Usd

from spin_usd.stage.read.stage_reader import StageReader

BRIGHTER, MOVED, LATER = "brighter", "moved", "later"
CLIPS = {"default": {"manifestAssetPath": "./none.usda"}}
TEXT = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
    startTimeCode = 0
    endTimeCode = 4
    renderSettingsPrimPath = "/Render"
)
def RenderSettings "Render"
{
    int2 resolution = (64, 48)
    rel camera = </World/Camera>
}
class "Motion"
{
    double3 xformOp:translate.timeSamples = { 0: (0, 0, -9), 4: (1, 0, -7) }
}
def Xform "World" (
    prepend variantSets = "augmentation"
)
{
    variantSet "augmentation" = {
        "brighter" {
            over "Sun"
            {
                float inputs:intensity = 9
            }
        }
        "moved" {
            over "Target"
            {
                double3 xformOp:translate.timeSamples = { 0: (0, 1, -9), 4: (1, 1, -7) }
            }
        }
        "later" {
            over "Target" (
                prepend references = </Motion> (offset = 2)
            )
            {
            }
        }
    }
    def Camera "Camera"
    {
        float focalLength = 35
    }
    def DistantLight "Sun"
    {
    }
    def Xform "Target" (
        prepend apiSchemas = ["SpinTargetAPI"]
        prepend references = </Motion>
    )
    {
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Cube "Box"
        {
        }
    }
}
"""


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    """A target that moves in time, and variants that change its light, its place, and when it is there."""
    path = tmp_path_factory.mktemp("variants") / "stage.usda"
    path.write_text(TEXT, encoding="utf-8")
    return path


def poses_of(reader):
    return [reader.scene(frame).bodies[0].T_cam_body for frame in reader.frames]


def shared(stage, variant):
    """The poses of the stage without the variant, and those of a reader that takes them over."""
    before = StageReader(stage, keep_poses=True)
    return poses_of(before), poses_of(StageReader(stage, variant=variant, after=before, keep_poses=True))


def matrices(poses):
    return [pose.matrix.tolist() for pose in poses]


@pytest.mark.parametrize("variant", [BRIGHTER, MOVED, LATER])
def test_a_variant_has_the_poses_that_it_has_alone(stage, variant) -> None:
    _, after = shared(stage, variant)
    assert matrices(after) == matrices(poses_of(StageReader(stage, variant=variant)))


def test_what_a_variant_does_not_move_is_not_computed_again(stage) -> None:
    before, after = shared(stage, BRIGHTER)
    assert all(a is b for a, b in zip(after, before, strict=True))


@pytest.mark.parametrize("variant", [MOVED, LATER])
def test_what_a_variant_moves_is_another_pose(stage, variant) -> None:
    before, after = shared(stage, variant)
    assert matrices(after) != matrices(before)


def test_what_comes_from_clips_is_not_shared(stage) -> None:
    opened = Usd.Stage.Open(Sdf.Layer.FindOrOpen(str(stage)), Sdf.Layer.CreateAnonymous())
    opened.SetEditTarget(opened.GetSessionLayer())
    opened.GetPrimAtPath("/World/Target").SetMetadata("clips", CLIPS)
    reader = StageReader(stage, stage=opened, keep_poses=True)
    assert [body.shared for body in reader.bodies] == [None]

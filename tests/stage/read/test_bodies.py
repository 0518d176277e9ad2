"""Several bodies of one stage: targets by their order, and all other geometry as occluders, each in its own place."""

import numpy as np
import pytest

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader

RANGE = "metersPerUnit = 1\nstartTimeCode = 0\nendTimeCode = 2"
SECOND = """
def Xform "Second" (prepend apiSchemas = ["SpinTargetAPI"])
{
    string spin:target:name = "second"
    double3 xformOp:translate.timeSamples = {
        0: (1, 0, -8),
        2: (3, 0, -8),
    }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Sphere "Ball" {
        double radius = 0.5
    }
}
"""
ARM = """
def Xform "Arm"
{
    double3 xformOp:translate = (0.2, 0, -1)
    float3 xformOp:scale = (1, 0.1, 0.1)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
    def Cube "Boom" {
        double size = 0.4
    }
}
"""
DEBRIS = """
def Cube "Debris"
{
    double size = 0.1
    double3 xformOp:translate.timeSamples = {
        0: (0, 1, -5),
        2: (0, 3, -5),
    }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
BOX = """
def Cube "Box{number}"
{{
    double3 xformOp:translate = (0, {number}, -30)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""
MOVING_CAMERA = """
        double3 xformOp:translate.timeSamples = {
            0: (0, 0, 0),
            2: (0.123456789, 0.5, 0.25),
        }
        double xformOp:rotateX.timeSamples = {
            0: 0,
            2: 3.3,
        }
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
"""


def scenes(path):
    reader = StageReader(path)
    return [reader.scene(frame) for frame in reader.frames]


@pytest.fixture
def two(make_stage):
    """A stage of two targets and debris, with an arm fixed to a camera that moves."""
    return make_stage(metadata=RANGE, world=SECOND + DEBRIS, camera=MOVING_CAMERA + ARM)


def test_targets_come_in_the_stages_order_and_occluders_after_them(two) -> None:
    first, *_ = found = scenes(two)
    assert [[body.id for body in scene.bodies] for scene in found] == [[1, 2, 0, 0]] * 3
    assert [body.target.path for body in first.bodies] == [
        "/World/Target", "/World/Second", "/World/Camera", "/World/Debris",
    ]  # fmt: skip
    assert [body.target.name for body in first.targets] == ["Target", "second"]
    assert not [finding for finding in check_stage(two) if finding.severity == "error"]


def test_each_body_has_the_pose_that_usd_gives_it(make_stage) -> None:
    found = scenes(make_stage(metadata=RANGE, world=SECOND + DEBRIS))
    for time, scene in enumerate(found):
        _, second, debris = scene.bodies
        np.testing.assert_allclose(second.T_cam_body.translation, (1 + time, 0, 8), atol=1e-15)
        np.testing.assert_allclose(debris.T_cam_body.translation, (0, -1 - time, 5), atol=1e-15)
    assert found[2].bodies[1].target is found[0].bodies[1].target


def test_what_is_fixed_to_the_camera_keeps_its_pose_to_the_bit(two) -> None:
    """So a camera that moves makes no other labels of its arm, whose points are scaled unequally and not rounded."""
    arms = [scene.bodies[2] for scene in scenes(two)]
    assert all(arm.target is arms[0].target for arm in arms)
    assert all(np.array_equal(arm.T_cam_body.matrix, arms[0].T_cam_body.matrix) for arm in arms)
    places = arms[0].T_cam_body.points(arms[0].target.mesh.box)
    np.testing.assert_allclose(np.sort(places, axis=0), [(0.0, -0.02, 0.98), (0.4, 0.02, 1.02)], atol=1e-12)


def test_all_that_stands_still_below_one_prim_is_one_occluder(make_stage) -> None:
    station = "".join(BOX.format(number=number) for number in range(3))
    (scene,) = scenes(make_stage(world=station))
    (body,) = scene.bodies[1:]
    assert [part.path for part in body.target.parts] == ["/World/Box0", "/World/Box1", "/World/Box2"]
    assert body.target.mesh.count == 36


@pytest.mark.parametrize("open_time", [0.0, 0.5])
def test_bodies_move_while_the_shutter_is_open(make_stage, open_time) -> None:
    camera = f"{ARM}\ndouble shutter:open = {-open_time}\ndouble shutter:close = {open_time}"
    scene = scenes(make_stage(metadata=RANGE, world=SECOND, camera=camera))[1]
    _, second, arm = scene.bodies
    assert bool(scene.shutter) == bool(second.poses) == bool(open_time)
    if open_time:
        np.testing.assert_allclose([pose.translation[0] for pose in second.poses], np.linspace(1.5, 2.5, 9))
        assert len({pose.matrix.tobytes() for pose in arm.poses}) == 1


def test_geometry_that_holds_a_target_or_the_camera_is_refused(make_stage) -> None:
    path = make_stage()
    path.write_text(path.read_text().replace('def Xform "World"', 'def Cube "World"'))
    with pytest.raises(UnsupportedError, match="/World: is geometry that holds a target or a camera"):
        StageReader(path)
    assert "/World" in {finding.where for finding in check_stage(path) if finding.code == "scene"}


def test_a_target_of_which_nothing_is_visible_is_refused(make_stage) -> None:
    with pytest.raises(StageError, match="/World/Second: the target has no geometry that is rendered"):
        scenes(make_stage(world=SECOND.replace("def Sphere", "over Sphere")))


def in_turn(name: str, shown: str) -> str:
    """A target that USD's `shown` tokens show, picture by picture."""
    samples = "\n".join(f'{time}: "{"inherited" if each == "1" else "invisible"}",' for time, each in enumerate(shown))
    return f"""
def Xform "{name}" (prepend apiSchemas = ["SpinTargetAPI"])
{{
    token visibility.timeSamples = {{
{samples}
    }}
    double3 xformOp:translate = (0, 0, -8)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Sphere "Ball" {{
    }}
}}
"""


@pytest.mark.parametrize("most", [1 << 22, 1])
def test_targets_in_turn_are_shown_when_usd_shows_them_and_read_once_where_they_are_few(
    make_stage, monkeypatch, most
) -> None:
    monkeypatch.setattr("spin_usd.stage.read.body_readers.MAX_KEPT_FACES", most)
    shown = ("10010", "01100", "00101")
    found = scenes(make_stage(metadata=RANGE.replace("2", "4"), world="".join(map(in_turn, "ABC", shown))))
    names = [[body.target.name for body in scene.targets][1:] for scene in found]
    assert names == [[name for name, own in zip("ABC", shown, strict=True) if own[time] == "1"] for time in range(5)]
    again = found[0].targets[1].target is found[3].targets[1].target
    assert again == (most > 1)
    assert found[0].targets[0].target is found[4].targets[0].target  # what every picture shows stays


def test_a_stage_whose_targets_are_all_hidden_is_refused_also_after_it_showed_them(make_stage) -> None:
    path = make_stage(metadata=RANGE, world=in_turn("A", "101"))
    path.write_text(path.read_text().replace('def Xform "Target"', 'over "Target"', 1))
    reader = StageReader(path)
    reader.scene(reader.frames[0])
    with pytest.raises(StageError, match="no geometry that is rendered"):
        reader.scene(reader.frames[1])

"""A scene says where in the picture its bodies are, and is one of each body alone."""

import pytest

from spin_usd.errors import GeometryError
from spin_usd.geometry.region import union
from spin_usd.scene.body import Body
from tests.cases.scenes import box, pose, scene, target

BOX = target(*box())


def two(**fields):
    """A scene of a box and of another one beside it."""
    other = Body(id=2, target=target(*box(), parts=[*[1] * 6, *[2] * 6]), T_cam_body=pose(t=(1.5, 0.2, 6)))
    return scene(BOX, others=(other,), **fields)


def test_a_scene_knows_the_pixels_of_its_target() -> None:
    s = scene(BOX)
    uv = s.camera.project(s.T_cam_body.points(box()[0]))
    assert (uv.min(0) >= (s.region.x0, s.region.y0)).all()
    assert (uv.max(0) <= (s.region.x1, s.region.y1)).all()
    assert s.region.width < s.camera.width


def test_one_target_is_a_scene_of_its_own() -> None:
    s = scene(BOX)
    assert s.one_body_scenes == (s,)
    assert [body.id for body in s.targets] == [1]


def test_regions_of_several_bodies_are_those_of_each_together() -> None:
    s = two()
    alone = [scene(body.target, T_cam_body=body.T_cam_body) for body in s.bodies]
    assert [one.region for one in s.one_body_scenes] == [one.region for one in alone]
    assert s.region == s.picture_region == union(one.region for one in alone)
    assert s.outline_pixels == sum(one.outline_pixels for one in alone)


def test_ids_of_parts_count_on_from_body_to_body() -> None:
    occluder = Body(id=0, target=BOX, T_cam_body=pose(t=(0, 1, 5)))
    s = two()
    s = scene(BOX, others=(*s.bodies[1:], occluder))
    assert s.part_offsets == (0, 1, 3)
    assert [body.id for body in s.targets] == [1, 2]


def test_a_body_whose_pose_is_not_that_of_its_shutter_is_refused() -> None:
    with pytest.raises(GeometryError, match="is not the shutter's middle"):
        Body(id=2, target=BOX, T_cam_body=pose(), poses=(pose(), pose(t=(0, 0, 5)), pose()))
    with pytest.raises(GeometryError, match="expected 1 or more"):
        Body(id=-1, target=BOX, T_cam_body=pose())

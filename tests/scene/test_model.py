"""A scene says where in the picture its target is."""

from tests.cases.scenes import box, scene, target


def test_a_scene_knows_the_pixels_of_its_target() -> None:
    s = scene(target(*box()))
    uv = s.camera.project(s.T_cam_body.points(box()[0]))
    assert (uv.min(0) >= (s.region.x0, s.region.y0)).all()
    assert (uv.max(0) <= (s.region.x1, s.region.y1)).all()
    assert s.region.width < s.camera.width

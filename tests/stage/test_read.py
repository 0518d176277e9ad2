"""StageReader: camera, pose, frames; what does not change is the same object."""

import numpy as np
import pytest


def test_a_box_before_the_camera(read_scene):
    scene = read_scene()
    assert scene.frame.name == "frame_000000"
    assert (scene.camera.width, scene.camera.height, scene.camera.fx, scene.camera.cy) == (200, 120, 250, 60)
    np.testing.assert_allclose(scene.T_cam_body.translation, [0, 0, 10], atol=1e-15)
    np.testing.assert_allclose(scene.T_cam_body.rotation, np.diag([1, -1, -1]), atol=1e-15)
    assert len(scene.target.mesh.faces) == 12
    assert [(p.id, p.path, p.name, p.class_name) for p in scene.target.parts] == [
        (1, "/World/Target/Box", "Box", "unknown")
    ]

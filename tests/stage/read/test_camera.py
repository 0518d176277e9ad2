"""Which camera, its intrinsics from pixels or from apertures (USD's own frustum as authority)."""

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.camera import find_camera, read_camera

FLOAT32 = 1e-5  # USD's apertures are float32; the frustum's numbers are ratios of them


def settings(extra="", camera="/World/Camera") -> str:
    return f"""
    def RenderSettings "Settings"
    {{
        rel camera = <{camera}>
        {extra}
    }}"""


NAMED = 'metersPerUnit = 1\nrenderSettingsPrimPath = "/World/Settings"'
APERTURES = """
    float focalLength = 35
    float horizontalAperture = 24
    float verticalAperture = 16
    float horizontalApertureOffset = 1.5
    float verticalApertureOffset = -0.75
"""


def camera_of(path, time=0):
    stage = open_stage(path)
    return read_camera(find_camera(stage), Usd.TimeCode(time))


def test_the_lens_is_read_to_the_last_bit(make_stage) -> None:
    found = camera_of(make_stage(camera="double spin:lens:k1 = -0.22383016606510672\ndouble spin:lens:k3 = 0.1"))
    assert (found.width, found.height, found.fx, found.fy, found.cx, found.cy) == (200, 120, 250, 240, 100, 60)
    assert found.distortion == (-0.22383016606510672, 0, 0, 0, 0.1)


def test_apertures_project_as_usds_own_frustum(make_stage) -> None:
    path = make_stage(camera=APERTURES, apis=(), metadata=NAMED, world=settings("int2 resolution = (600, 400)"))
    found = camera_of(path)
    stage = Usd.Stage.Open(str(path))
    frustum = UsdGeom.Camera(stage.GetPrimAtPath("/World/Camera")).GetCamera(Usd.TimeCode(0)).frustum
    to_clip = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
    for point in ([0.1, 0.2, -3], [-1, 0.5, -4], [0, 0, -1]):
        x, y, _ = to_clip.Transform(Gf.Vec3d(*point))
        expected = [(x + 1) / 2 * found.width, (1 - y) / 2 * found.height]
        np.testing.assert_allclose(found.project(np.array(point) * [1, -1, -1]), expected, rtol=FLOAT32)


@pytest.mark.parametrize(
    ("policy", "across", "down"),  # pixels per unit of aperture, for an image of 3:1 and an aperture of 3:2
    [
        ("expandAperture", 200 / 16, 200 / 16),
        ("cropAperture", 600 / 24, 600 / 24),
        ("adjustApertureWidth", 200 / 16, 200 / 16),
        ("adjustApertureHeight", 600 / 24, 600 / 24),
        ("adjustPixelAspectRatio", 600 / 24, 200 / 16),
    ],
)
def test_conform_policies(make_stage, policy, across, down) -> None:
    extra = f'int2 resolution = (600, 200)\nuniform token aspectRatioConformPolicy = "{policy}"'
    found = camera_of(make_stage(camera=APERTURES, apis=(), metadata=NAMED, world=settings(extra)))
    np.testing.assert_allclose([found.fx, found.fy], [35 * across, 35 * down], rtol=FLOAT32)


def test_render_settings_choose_among_cameras(make_stage) -> None:
    second = 'def Camera "Second" {}\n'
    with pytest.raises(StageError, match="has 2 cameras"):
        camera_of(make_stage(world=second))
    stage = open_stage(make_stage(world=second + settings(), metadata=NAMED, name="b.usda"))
    assert find_camera(stage).GetPath() == "/World/Camera"


@pytest.mark.parametrize(
    ("options", "error", "saying"),
    [
        ({"metadata": NAMED, "world": settings(camera="/World/Target")}, StageError, "is not a Camera prim"),
        ({"metadata": NAMED}, StageError, "/World/Settings is not a RenderSettings prim"),
        (
            {"metadata": NAMED, "world": settings("int2 resolution = (20, 20)")},
            StageError,
            "has 200x120 pixels, but the resolution of its pictures is",
        ),
        (
            {"metadata": NAMED, "world": settings("float4 dataWindowNDC = (0, 0, 0.5, 1)")},
            UnsupportedError,
            "dataWindowNDC",
        ),
        ({"camera": 'token projection = "orthographic"'}, UnsupportedError, "is not a perspective camera"),
        (
            {"camera": 'uniform token spin:lens:model = "ftheta"'},
            StageError,
            "lens:model: is 'ftheta'; choose one of",
        ),
        ({"camera": "double spin:lens:k1 = -20"}, StageError, "cannot be inverted"),
        ({"camera": "double spin:lens:k1 = nan"}, StageError, "k1: is nan"),
    ],
)
def test_cameras_that_are_none(make_stage, options, error, saying) -> None:
    with pytest.raises(error, match=saying):
        camera_of(make_stage(**options))


@pytest.mark.parametrize(
    ("old", "new", "saying"),
    [
        ("spin:lens:fx = 250", "spin:lens:fx = 0", "focal length is"),
        ("spin:lens:fx = 250", "spin:lens:fx = -5", "focal length is"),
        ("spin:lens:imageSize = (200, 120)", "spin:lens:imageSize = (0, 120)", "width is 0"),
        ("spin:lens:imageSize = (200, 120)", "spin:lens:imageSize = (200, 9000000)", "height is 9000000"),
        ("double spin:lens:fx = 250", "", "lacks spin:lens:fx"),
    ],
)
def test_lenses_that_are_none(make_stage, old, new, saying) -> None:
    path = make_stage()
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(StageError, match=f"^/World/Camera: .*{saying}"):
        camera_of(path)


def test_a_plain_camera_needs_a_resolution(make_stage) -> None:
    with pytest.raises(StageError, match=r"^/World/Camera: has no size in pixels"):
        camera_of(make_stage(apis=()))


def test_no_camera_at_all(make_stage) -> None:
    path = make_stage()
    path.write_text(path.read_text().replace('def Camera "Camera"', 'over "Camera"'))
    with pytest.raises(StageError, match="the stage has no camera"):
        camera_of(path)

"""Suns: irradiance by UsdLux's own rules, direction in camera axes; other lights refused."""

import numpy as np
import pytest
from pxr import UsdLux

from spin_usd.errors import StageError, UnsupportedError

FLOAT32 = 1e-6


def sun(attributes="", kind="DistantLight", metadata=""):
    return f"""def {kind} "Sun" {metadata}
    {{
        float inputs:intensity = 100
        {attributes}
    }}"""


def light(read_scene, *arguments, **options):
    (found,) = read_scene(world=sun(*arguments, **options)).lights
    return found


@pytest.mark.parametrize(
    ("attributes", "irradiance"),
    [
        ("bool inputs:normalize = 1", (100, 100, 100)),
        ("bool inputs:normalize = 1\nfloat inputs:angle = 5", (100, 100, 100)),
        ("bool inputs:normalize = 1\nfloat inputs:exposure = 3", (800, 800, 800)),
        ("bool inputs:normalize = 1\ncolor3f inputs:color = (1, 0.5, 0)", (100, 50, 0)),
        ("float inputs:angle = 10", (100 * np.pi * np.sin(np.radians(5)) ** 2,) * 3),
        ("float inputs:angle = 180", (100 * np.pi,) * 3),  # a whole hemisphere of radiance L: pi L
        ("float inputs:angle = 0", (100, 100, 100)),
    ],
)
def test_irradiance(read_scene, attributes, irradiance):
    np.testing.assert_allclose(light(read_scene, attributes).irradiance, irradiance, rtol=FLOAT32)


def test_color_temperature_counts_only_where_it_is_enabled(read_scene):
    off = "bool inputs:normalize = 1\nfloat inputs:colorTemperature = 3000\n"
    assert light(read_scene, off).irradiance == (100, 100, 100)
    on = read_scene(world=sun(off + "bool inputs:enableColorTemperature = 1"), name="on.usda").lights[0]
    np.testing.assert_allclose(on.irradiance, 100 * np.array(UsdLux.BlackbodyTemperatureAsRgb(3000)), rtol=FLOAT32)


def test_direction_is_in_camera_axes(read_scene):
    """A light shines along its own -z. This one, turned 90 degrees about y, shines along world -x; the camera, turned
    90 degrees about x, looks along world +y with +z up: -x is to its left, -x of an OpenCV camera."""
    turned = 'float xformOp:rotateY = 90\nuniform token[] xformOpOrder = ["xformOp:rotateY"]'
    camera = 'float xformOp:rotateX = 90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]'
    found = read_scene(world=sun(turned), camera=camera).lights[0]
    np.testing.assert_allclose(found.direction_cam, (-1, 0, 0), atol=1e-15)
    assert found.angle == pytest.approx(np.radians(0.53))
    straight = read_scene(world=sun(), camera=camera, name="b.usda").lights[0]
    np.testing.assert_allclose(straight.direction_cam, (0, 1, 0), atol=1e-15)  # world -z is down, +y of the camera


def test_invisible_and_inactive_lights_are_off(read_scene):
    assert read_scene(world=sun('token visibility = "invisible"')).lights == ()
    assert read_scene(world=sun(metadata="(\nactive = false\n)"), name="b.usda").lights == ()
    assert read_scene(world=sun('token visibility = "invisible"', kind="DomeLight"), name="c.usda").lights == ()


@pytest.mark.parametrize("kind", ["DomeLight", "SphereLight", "RectLight", "DiskLight", "CylinderLight"])
def test_other_lights_are_refused_by_name(read_scene, kind):
    with pytest.raises(UnsupportedError, match=f"^/World/Sun: is a {kind}"):
        read_scene(world=sun(kind=kind))


@pytest.mark.parametrize(
    ("attributes", "error", "saying"),
    [
        ("float inputs:diffuse = 0.5", UnsupportedError, "its inputs:diffuse is not 1"),
        ("float inputs:angle = 200", UnsupportedError, "its angle is 200"),
        ("rel light:filters = </World/Target>", UnsupportedError, "has light filters"),
        ("rel collection:lightLink:excludes = </World/Target>", UnsupportedError, "is linked by lightLink"),
        ("float inputs:exposure = nan", StageError, "its irradiance is"),
        ("color3f inputs:color = (-1, 0, 0)", StageError, "its irradiance is"),
    ],
)
def test_what_a_sun_does_not_do_is_refused(read_scene, attributes, error, saying):
    with pytest.raises(error, match=f"^/World/Sun: {saying}"):
        read_scene(world=sun(attributes))

"""Every parameter changes what of the scene it says, and nothing else."""

import re
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest

from spin_usd.commands.author.augment import augment_stage
from spin_usd.errors import InputError
from spin_usd.scene.content import content, key_of
from spin_usd.stage.augment.parameter import UNITS
from spin_usd.stage.augment.parameters import PARAMETERS, parameter_named
from spin_usd.stage.read.stage_reader import StageReader

STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
    metersPerUnit = 1
)

class Xform "Base"
{
    def Camera "Camera" (
        prepend apiSchemas = ["SpinEventSensorAPI", "SpinLensAPI", "SpinSensorAPI"]
        doc = "Without SpinOpticsAPI: augment applies it."
    )
    {
        int2 spin:lens:imageSize = (200, 120)
        double spin:lens:fx = 250
        double spin:lens:fy = 240
        double spin:lens:cx = 100
        double spin:lens:cy = 60
        float focalLength = 0.5
        float horizontalAperture = 0.4
        float exposure = 1
        float fStop = 8
        float focusDistance = 10
        double spin:sensor:gain = 4
        double spin:sensor:readNoise = 5
        token spin:sensor:channels = "rgb"
        token spin:sensor:encoding = "gamma"
        bool spin:sensor:autoExposure = 1
    }

    def Xform "Target" (
        prepend apiSchemas = ["SpinTargetAPI"]
    )
    {
        double3 xformOp:translate = (0, 0, -10)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Cube "Box" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {
            rel material:binding = </Base/Target/Paint>
        }
        def Material "Paint"
        {
            token outputs:surface.connect = </Base/Target/Paint/Surface.outputs:surface>
            def Shader "Surface"
            {
                uniform token info:id = "UsdPreviewSurface"
                float inputs:roughness = 0.5
                color3f inputs:diffuseColor = (0.2, 0.4, 0.6)
                token outputs:surface
            }
        }
    }

    def Xform "Lights"
    {
        float xformOp:rotateX = 25
        uniform token[] xformOpOrder = ["xformOp:rotateX"]
        def DistantLight "Weak"
        {
            float inputs:intensity = 10
            bool inputs:normalize = 1
        }
        def DistantLight "Sun"
        {
            float inputs:intensity = 500
            float inputs:exposure = 1
            bool inputs:normalize = 1
            float xformOp:rotateY = 40
            uniform token[] xformOpOrder = ["xformOp:rotateY"]
        }
        def SphereLight "Lamp"
        {
            float inputs:intensity = 3
            float inputs:radius = 0.5
            double3 xformOp:translate = (5, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
    def Xform "Sky"
    {
        float xformOp:rotateY = 15
        uniform token[] xformOpOrder = ["xformOp:rotateY"]
        def Xform "Earth" (
            prepend apiSchemas = ["SpinPlanetAPI"]
        )
        {
            double3 spin:planet:radii = (6378137, 6378137, 6356752)
            double3 xformOp:translate = (0, -6800000, -3000000)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
}

def Xform "World" (
    doc = "By reference, so that variants can override."
    prepend references = </Base>
)
{
}
"""
DIRECTION, ATTITUDE = (0.6, 0.0, -0.8), (0.5, 0.5, 0.5, 0.5)
SHAPED = {"bodies.0.target.mesh.": None, "bodies.0.target.shape": None}
# parameter: (its value in its own unit, what of the scene changes, and to what)
CASES: dict[str, tuple[Any, dict[str, Any]]] = {
    "sun.direction": (list(DIRECTION), {"lights.1.direction_cam": (-0.6, 0, 0.8)}),
    "sun.from_target": (list(DIRECTION), {"lights.1.direction_cam": (-0.6, 0, -0.8)}),  # the body's axes are USD's
    "sun.2.direction": (list(DIRECTION), {"lights": None}),
    "sun.1.factor": (0.5, {"lights.1.irradiance": (500, 500, 500)}),
    "sun.shining": (1, {}),
    "sun.irradiance": (1200, {"lights.1.irradiance": (1200, 1200, 1200)}),
    "sun.factor": (0.5, {"lights.1.irradiance": (500, 500, 500)}),
    "fill.factor": (2, {"lights.0.irradiance": (20, 20, 20), "lights.2.emission": (6, 6, 6)}),
    "lights.factor": (
        3,
        {
            "lights.0.irradiance": (30, 30, 30),
            "lights.1.irradiance": (3000, 3000, 3000),
            "lights.2.emission": (9, 9, 9),
        },
    ),
    "sun.temperature": (4000, {"lights.1.irradiance": None}),
    "fill.temperature": (4000, {"lights.0.irradiance": None, "lights.2.emission": None}),
    "lights.temperature": (
        4000,
        {"lights.0.irradiance": None, "lights.1.irradiance": None, "lights.2.emission": None},
    ),
    "sun.angle": (2.0, {"lights.1.angle": np.radians(2)}),
    "exposure.stops": (1.5, {"sensor.exposure": None}),
    "exposure.time": (0.02, {"sensor.exposure": None, "sensor.time": 0.02}),
    "exposure.iso": (400, {"sensor.exposure": None, "sensor.iso": 400}),
    "exposure.responsivity": (2, {"sensor.exposure": None}),
    "exposure.level": (0.3, {"sensor.auto_exposure.level": 0.3}),
    "optics.psf_sigma": (0.7, {"optics.psf_sigma": 0.7}),
    "optics.glare": (0.1, {"optics.glare": 0.1}),
    "optics.glare_core": (6, {"optics.glare_core": 6}),
    "optics.glare_falloff": (2.5, {"optics.glare_falloff": 2.5}),
    "optics.bloom_intensity": (0.5, {"optics.bloom_intensity": 0.5}),
    "optics.bloom_scatter": (0.3, {"optics.bloom_scatter": 0.3}),
    "optics.bloom_threshold": (2, {"optics.bloom_threshold": 2}),
    "optics.vignetting": (-0.2, {"optics.vignetting": (-0.2, 0, 0)}),
    "sensor.gain": (2, {"sensor.gain": 2}),
    "sensor.full_well": (9000, {"sensor.full_well": 9000}),
    "sensor.read_noise": (8, {"sensor.read_noise": 8}),
    "sensor.dark_current": (30, {"sensor.dark_current": 30}),
    "sensor.prnu": (0.01, {"sensor.prnu": 0.01}),
    "sensor.pattern_seed": (7, {"sensor.pattern_seed": 7}),
    "sensor.adc_bits": (10, {"sensor.adc_bits": 10}),
    "sensor.black_level": (16, {"sensor.black_level": 16}),
    "sensor.jpeg_quality": (75, {"sensor.jpeg_quality": 75}),
    "sensor.contrast": (1.2, {"sensor.contrast": 1.2}),
    "sensor.saturation": (0.8, {"sensor.saturation": 0.8}),
    "sensor.gamma": (1.8, {"sensor.gamma": 1.8}),
    "event.threshold_on": (0.3, {"event_sensor.threshold_on": 0.3}),
    "event.threshold_off": (0.3, {"event_sensor.threshold_off": 0.3}),
    "event.threshold_spread": (0.02, {"event_sensor.threshold_spread": 0.02}),
    "event.dark": (0.01, {"event_sensor.dark": 0.01}),
    "event.cutoff": (300, {"event_sensor.cutoff": 300}),
    "event.leak": (0.1, {"event_sensor.leak": 0.1}),
    "event.shot_noise": (5, {"event_sensor.shot_noise": 5}),
    "event.shot_noise_in_white": (0.5, {"event_sensor.shot_noise_in_white": 0.5}),
    "event.refractory": (1e-4, {"event_sensor.refractory": 1e-4}),
    "event.latency": (2e-4, {"event_sensor.latency": 2e-4}),
    "event.jitter": (3e-5, {"event_sensor.jitter": 3e-5}),
    "lens.fx": (2, {"camera.fx": 252}),
    "lens.fy": (-2, {"camera.fy": 238}),
    "lens.cx": (1.5, {"camera.cx": 101.5}),
    "lens.cy": (-1.5, {"camera.cy": 58.5}),
    "lens.k1": (0.01, {"camera.distortion": (0.01, 0, 0, 0, 0)}),
    "lens.k2": (0.01, {"camera.distortion": (0, 0.01, 0, 0, 0)}),
    "lens.p1": (0.001, {"camera.distortion": (0, 0, 0.001, 0, 0)}),
    "lens.p2": (0.001, {"camera.distortion": (0, 0, 0, 0.001, 0)}),
    "lens.k3": (0.01, {"camera.distortion": (0, 0, 0, 0, 0.01)}),
    "focus.distance": (12, {"thin_lens.focus": 12}),
    "focus.fstop": (4, {"thin_lens.radius": 0.5 * 0.1 / 8}),
    "earth.direction": ([0.0, 0.6, 0.8], {"environment.planets.0.T_cam_planet.translation": None}),
    "earth.altitude": (4e5, {"environment.planets.0.T_cam_planet.translation": None}),
    "earth.attitude": (list(ATTITUDE), {"environment.planets.0.T_cam_planet.rotation": None}),
    "earth.visible": (False, {"environment.planets": None}),
    "material.Paint.roughness": (0.25, {"bodies.0.target.materials.0.roughness": 0.25}),
    "material.*.diffuseColor.factor": (0.5, {"bodies.0.target.materials.0.diffuse_color": (0.1, 0.2, 0.3)}),
    "part.Box.axis": (list(DIRECTION), {}),
    **dict.fromkeys(("part.Box.turn", "part.*.bent"), (9, SHAPED)),
    **dict.fromkeys(("part.Box.shift.x", "part.Box.shift.y", "part.Box.shift.z"), (0.5, SHAPED)),
    **dict.fromkeys(("part.Box.scale", "part.Box.bulged"), (0.5, SHAPED)),
    "/World/Camera.spin:sensor:fullWell": (7000, {"sensor.full_well": 7000}),
}
ROUNDED = 1e-8  # quaternions are written with nine digits
FLOAT32 = 1e-6  # relative: most of USD's own attributes are floats


def flat(value, path=""):
    """Every number of a scene, by where it is."""
    if is_dataclass(value):
        members = {f.name: getattr(value, f.name) for f in fields(value)}
    elif isinstance(value, tuple) and any(is_dataclass(item) for item in value):
        members = {str(i): item for i, item in enumerate(value)}
    else:
        return {path: value}
    return {k: v for name, item in members.items() for k, v in flat(item, f"{path}.{name}" if path else name).items()}


def same(a, b):
    """Whether two values of `flat` are equal, but for the last bits of numbers."""
    if content(a) == content(b):
        return True
    if a is None or b is None or np.array(a).dtype.kind != "f" or np.shape(a) != np.shape(b):
        return False
    return np.allclose(a, b, rtol=1e-12, atol=0)


def batched(items, size):
    """Lists of so many items, of which the last may be shorter; itertools has this from Python 3.12 on."""
    items = list(items)
    return [items[start : start + size] for start in range(0, len(items), size)]


def toml(value):
    return str(value).lower() if isinstance(value, bool) else str(value)


@pytest.fixture(scope="module")
def readers(tmp_path_factory):
    """The stage of each case, by parameter, and the nominal one. A reader numbers the parts of all variants of its
    stage: with eight in each stage that is done for 500, with all in one for 4,500."""
    found: dict[str, StageReader] = {}
    for cases in batched(CASES.items(), 8):
        found |= readers_of(tmp_path_factory.mktemp("parameters"), dict(cases))
    return found


def readers_of(folder, cases):
    (folder / "stage.usda").write_text(STAGE)
    lines = ['schema = "augment-1"']
    for i, (name, (value, _)) in enumerate(cases.items()):
        unit = parameter_named(name).unit
        given = f', unit = "{unit}"' if unit else ""
        lines += ["[[augmentation]]", f'name = "v{i}"', "[augmentation.sample]"]
        lines += [f'"{name}" = {{ distribution = "fixed", value = {toml(value)}{given} }}']
    (folder / "all.toml").write_text("\n".join(lines))
    augment_stage(stage=folder / "stage.usda", spec=str(folder / "all.toml"))
    variants = {**{name: f"v{i}" for i, name in enumerate(cases)}, "nominal": "nominal"}
    return {name: StageReader(folder / "stage.usda", variant=variant) for name, variant in variants.items()}


@pytest.fixture(scope="module")
def scenes(readers):
    return {name: reader.scene(reader.frames[0]) for name, reader in readers.items()}


@pytest.fixture(scope="module")
def event_sensors(readers):
    return {name: reader.event_sensor(reader.frames[0]) for name, reader in readers.items()}


def test_there_is_a_case_for_every_parameter() -> None:
    assert set(PARAMETERS) <= set(CASES)


@pytest.mark.parametrize("name", CASES)
def test_it_changes_what_it_says_and_nothing_else(scenes, event_sensors, name) -> None:
    before, after = (flat(scenes[of]) | flat(event_sensors[of], "event_sensor") for of in ("nominal", name))
    changed = {
        path
        for path in set(before) | set(after)
        if not path.startswith("frame.") and not same(before.get(path), after.get(path))
    }
    expected = CASES[name][1]
    assert {path for path in changed if not any(path.startswith(e) for e in expected)} == set()
    assert all(any(path.startswith(e) for path in changed) for e in expected)
    for path, value in expected.items():
        if value is not None:
            np.testing.assert_allclose(after[path], value, rtol=FLOAT32, atol=ROUNDED)


def test_stops_double_the_signal(scenes) -> None:
    ratio = scenes["exposure.stops"].sensor.exposure / scenes["nominal"].sensor.exposure
    assert ratio == pytest.approx(2**1.5, rel=FLOAT32)


def test_the_planet_stands_and_lies_as_drawn(scenes) -> None:
    placed = scenes["earth.direction"].environment.planets[0].T_cam_planet
    own = scenes["nominal"].environment.planets[0].T_cam_planet
    far = np.linalg.norm(own.translation)
    np.testing.assert_allclose(placed.translation, np.array([0, 0.6, 0.8]) * far, atol=0.02)
    higher = scenes["earth.altitude"].environment.planets[0].T_cam_planet.translation
    assert np.linalg.norm(higher) == pytest.approx(6378137 + 4e5, abs=0.01)
    np.testing.assert_allclose(higher / np.linalg.norm(higher), own.translation / far, atol=1e-9)
    turned = scenes["earth.attitude"].environment.planets[0].T_cam_planet
    np.testing.assert_allclose(turned.quaternion, ATTITUDE, atol=1e-8)


def test_an_added_sun_is_like_the_sun_but_for_its_direction(scenes) -> None:
    before, after = ({light.path: light for light in scenes[name].lights} for name in ("nominal", "sun.2.direction"))
    (added,) = after.keys() - before.keys()
    sun = before[added.removesuffix("_2")]
    np.testing.assert_allclose(after[added].direction_cam, -np.array(DIRECTION), atol=ROUNDED)
    assert replace(after[added], direction_cam=sun.direction_cam, path=sun.path) == sun
    assert all(key_of(after[path]) == key_of(before[path]) for path in before)


def test_a_warmer_sun_is_redder(scenes) -> None:
    r, _, b = scenes["sun.temperature"].lights[1].irradiance
    assert r > 1000 > b


@pytest.mark.parametrize("own", UNITS)
def test_units_are_sizes_of_one_another(own) -> None:
    pint_like = {"deg": 1, "rad": 180 / np.pi, "ms": 1e-3, "us": 1e-6, "km": 1e3, "mm": 1e-3, "kW/m2": 1e3}
    for unit, factor in UNITS[own].items():
        assert factor == pytest.approx(pint_like.get(unit, 1))
    assert UNITS[own][own] == 1


def test_limits_are_those_of_the_reader() -> None:
    with pytest.raises(InputError, match=re.escape("optics.glare: could be 2; choose numbers from 0 to 1")):
        parameter_named("optics.glare").check(2.0)


def test_a_name_that_is_none_says_which_was_meant() -> None:
    with pytest.raises(InputError, match=r"sun.irradiace: is not a parameter; did you mean sun.irradiance\?"):
        parameter_named("sun.irradiace")

"""Laws of unit light: strengths and colours are gains, and nothing else of a scene is touched."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.transform import Transform
from spin_usd.scene.content import content
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings
from spin_usd.scene.derived.light_groups import CLASS, LightGroups, in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.environment import Environment, Planet
from spin_usd.scene.light import CylinderLight, DiskLight, DistantLight, DomeLight, PointLight, RectLight, SphereLight
from spin_usd.scene.material import Material
from tests.cases import scenes

DOUBLE = 1e-12
SETTINGS = RenderSettings(renderer="raycast", effort=Effort(samples=4), seed=7)
GLOWING = Material(path="/glow", emissive_color=(0.0, 0.5, 0.0))
WARM = (3.0, 2.0, 1.0)


def axes(name, t=(0.0, 0, 0)):
    return Transform(to="cam", of=name, rotation=np.eye(3), translation=np.array(t, float))


def sun(irradiance=(1361.0, 1361.0, 1361.0), **fields):
    return DistantLight(path="/Sun", direction_cam=(0, 0, 1), irradiance=irradiance, **fields)


def lamp(emission=WARM, kind=RectLight, lengths=(0.5, 0.5), **fields):
    own = dict(zip(kind.lengths, lengths, strict=True))
    return kind(path="/L", T_cam_light=axes("light"), emission=emission, **own, **fields)


def dome(radiance=(0.5, 0.5, 1.0)):
    return DomeLight(path="/Dome", T_cam_dome=axes("dome"), radiance=radiance)


def planet(**fields):
    return Planet(path="/P", T_cam_planet=axes("planet", (0, 9e6, 0)), radii=(6e6,) * 3, albedo=(0.3,) * 3, **fields)


def scene(*lights, planets=(), glowing=False):
    materials = (GLOWING,) if glowing else (scenes.GREY,)
    made = scenes.scene(scenes.target(*scenes.box(), materials=materials), lights=lights)
    return replace(made, environment=Environment(planets=tuple(planets)))


POINT = lamp((9.0, 9.0, 9.0), PointLight, ())
SCENES = {
    "nothing": scene(),
    "Sun": scene(sun()),
    "Sun and lamps": scene(sun(), lamp(), lamp((80.0, 80.0, 80.0), SphereLight, (0.1,)), POINT),
    "lamps of all shapes": scene(lamp(kind=DiskLight), lamp(kind=CylinderLight)),
    "Sun and domes": scene(sun(), dome(), dome((100.0, 0.0, 50.0))),
    "domes": scene(dome(), dome((1.0, 200.0, 3.0))),
    "Sun and planet": scene(sun(WARM), lamp(), planets=[planet()]),
    "Suns, dome and planet": scene(dome(), sun(), sun((0.0, 7.0, 0.0)), planets=[planet()]),
    "red Sun and planet": scene(sun((5.0, 0.0, 0.0)), planets=[planet()]),
    "planet that is only seen": scene(sun(), dome(), planets=[planet(illuminates=False)]),
    "planet in the dark": scene(lamp(), planets=[planet()]),
    "glow": scene(glowing=True),
    "Sun, dome and glow": scene(sun(), dome(), glowing=True),
    "Sun, planet, lamp and glow": scene(sun(), lamp(), planets=[planet()], glowing=True),
    "eclipse": scene(sun(obscuration=0.999), lamp(), dome()),
    "eclipse by a planet": scene(sun(obscuration=0.6), planets=[planet()]),
    "total eclipse": scene(sun(obscuration=1.0), lamp()),
    "lamps that are off": scene(sun((0.0, 0.0, 0.0)), lamp(), lamp((0.0, 0.0, 0.0)), dome((0.0, 0.0, 0.0))),
}
EACH = pytest.mark.parametrize("name", SCENES)


def emission(light):
    if isinstance(light, DistantLight):
        return light.irradiance
    return light.radiance if isinstance(light, DomeLight) else light.emission


def scaled(light, factor):
    r, g, b = (value * share for value, share in zip(emission(light), np.broadcast_to(factor, 3), strict=True))
    names = {DistantLight: "irradiance", DomeLight: "radiance"}
    return replace(light, **{names.get(type(light), "emission"): (float(r), float(g), float(b))})


@EACH
def test_the_lights_are_the_unit_lights_times_their_gains(name) -> None:
    """What reaches the target of each group, and whatever else a light says, is the same."""
    of, unit = SCENES[name], in_unit_light(SCENES[name])
    groups = LightGroups.of(of)
    assert groups == LightGroups.of(unit.scene)
    assert len(unit.gains) == groups.count
    for place, gain in zip(groups.placed, unit.gains, strict=False):
        light, one = of.lights[place], unit.scene.lights[place]
        was, now = (x.at_target if isinstance(x, DistantLight) else x.emission for x in (light, one))
        np.testing.assert_allclose(np.multiply(now, gain), was, rtol=DOUBLE)
    planets = bool(of.environment.illuminating)
    for light, one in zip(of.lights, unit.scene.lights, strict=True):
        kept = replace(one, obscuration=light.obscuration) if isinstance(one, DistantLight) else one
        assert content(scaled(kept, 0)) == content(scaled(light, 0))
        if groups.surroundings and (isinstance(light, DomeLight) or (planets and isinstance(light, DistantLight))):
            around = unit.gains[len(groups.placed)]
            np.testing.assert_allclose(np.multiply(emission(one), around), emission(light), rtol=DOUBLE)
    assert unit.scene.bodies[0].target is of.target
    assert unit.scene.environment is of.environment


@EACH
def test_a_scene_in_unit_light_is_its_own(name) -> None:
    once = in_unit_light(SCENES[name])
    twice = in_unit_light(once.scene)
    for one, two in zip(once.scene.lights, twice.scene.lights, strict=True):
        np.testing.assert_allclose(emission(two), emission(one), rtol=DOUBLE)
    for before, gain in zip(once.gains, twice.gains, strict=True):
        np.testing.assert_allclose(gain, np.not_equal(before, 0) | np.equal(gain, 1), rtol=DOUBLE)


@pytest.mark.parametrize("name", [name for name, of in SCENES.items() if of.lights and not LightGroups.of(of).emission])
@pytest.mark.parametrize("factor", [1e-3, 0.9, 2.0, 1e4])
def test_all_lights_may_be_so_much_stronger(name, factor) -> None:
    of = SCENES[name]
    stronger, unit = (
        in_unit_light(of.with_lights(tuple(scaled(light, factor) for light in of.lights))),
        in_unit_light(of),
    )
    for one, two in zip(unit.scene.lights, stronger.scene.lights, strict=True):
        np.testing.assert_allclose(emission(two), emission(one), rtol=DOUBLE)
    lamps_off = [np.any(emission(light)) for light in of.lights]
    if any(lamps_off):
        np.testing.assert_allclose(stronger.gains, np.multiply(unit.gains, factor), rtol=DOUBLE)


INDEPENDENT = {
    "Sun": (sun(), 1e4),
    "Sun of two strengths": (sun(WARM), 1e-6),
    "rect": (lamp((90.0,) * 3), 1.5),
    "point": (lamp((300.0,) * 3, PointLight, ()), 0.7),
    "dome": (dome((3.0, 4.0, 5.0)), 1.4),
}


BRIGHTER, WARMER, CYAN = (1.0, 1.0, 1.0), (1.05, 0.99, 0.97), (0.0, 1.2, 1.0)


@pytest.mark.parametrize(
    ("name", "colour"),  # a dome that lacks a colour is another
    [(n, c) for n in INDEPENDENT for c in (BRIGHTER, WARMER, CYAN) if (n, c) != ("dome", CYAN)],
)
def test_one_light_may_be_stronger_and_of_another_colour(name, colour) -> None:
    """Within CLASS of what it was among the others, only gains change: to the last bit, so that renders are found."""
    light, factor = INDEPENDENT[name]
    others = () if isinstance(light, DistantLight) else (sun(), lamp((50.0, 60.0, 70.0), SphereLight, (0.3,)))
    before, after = scene(light, *others), scene(scaled(light, np.multiply(factor, colour)), *others)
    assert KeyMaker(SETTINGS).keys(before).radiance == KeyMaker(SETTINGS).keys(after).radiance
    assert KeyMaker(SETTINGS).keys(before).exposure != KeyMaker(SETTINGS).keys(after).exposure
    one, two = in_unit_light(before).gains, in_unit_light(after).gains
    changed = [i for i, (a, b) in enumerate(zip(one, two, strict=True)) if a != b]
    assert changed == [len(one) - 1 if isinstance(light, DomeLight) else 0]


@pytest.mark.parametrize("ratio", [1e-4, 1e-2, 0.3, 1.0, 7.0, 1e3])
def test_rays_are_shared_out_by_strength_to_the_nearest_class(ratio) -> None:
    """Among the unit lights, the one brings the other's share of irradiance to within the square root of CLASS."""
    of = scene(sun((2.0,) * 3), replace(sun((2 * ratio,) * 3), direction_cam=(0, 1, 0)))
    one, other = (light.irradiance[0] for light in in_unit_light(of).scene.lights)
    assert CLASS**-0.5 <= other / one / ratio <= CLASS**0.5


@pytest.mark.parametrize("left", [1e-4, 1e-2, 0.9])
def test_a_sun_in_eclipse_gets_fewer_rays(left) -> None:
    (unit,) = in_unit_light(scene(sun(obscuration=1 - left), planets=[planet()])).scene.lights
    assert CLASS**-0.5 <= unit.at_target[0] / unit.irradiance[0] / left <= CLASS**0.5


def test_a_planet_that_is_only_seen_decides_the_picture_but_not_the_render() -> None:
    bare, seen, lighting = (scene(sun(), planets=planets) for planets in ([], [planet(illuminates=False)], [planet()]))
    assert (
        KeyMaker(SETTINGS).keys(bare).radiance
        == KeyMaker(SETTINGS).keys(seen).radiance
        != KeyMaker(SETTINGS).keys(lighting).radiance
    )
    assert KeyMaker(SETTINGS).keys(bare).exposure != KeyMaker(SETTINGS).keys(seen).exposure

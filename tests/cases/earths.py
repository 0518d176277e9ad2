"""Scenes with an Earth behind. All their numbers are given, none computed: they are the same on every processor."""

from dataclasses import replace

import numpy as np

from spin_usd.geometry.transform import Transform
from spin_usd.scene.environment import Environment, Planet
from spin_usd.scene.light import DistantLight
from spin_usd.scene.scene import Scene
from spin_usd.scene.texture import Image
from tests.cases import scenes

RADIUS = 6371e3
CAMERA = replace(scenes.SPEEDPLUS, width=384, height=240, fx=597.8, fy=597.7, cx=192.0, cy=120.0)
SUN = DistantLight(path="/Sun", direction_cam=(0.36, 0.48, 0.8), irradiance=(1361.0,) * 3, angle=0.0093)


def low() -> Scene:
    """The Earth from 400 km up, with its limb in the frame."""
    return seen_from((0.0, 0.96 * (RADIUS + 4e5), 0.28 * (RADIUS + 4e5)))


def whole() -> Scene:
    """The whole disc of the Earth."""
    return seen_from((0.0, 0.0, 4.2e7))


def seen_from(centre: tuple[float, float, float], **fields: object) -> Scene:
    """The Earth with its centre there, camera axes, metres; `fields` are the planet's."""
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    planet = Planet(
        path="/Earth",
        T_cam_planet=Transform(to="cam", of="planet", rotation=turn, translation=np.array(centre)),
        radii=(RADIUS,) * 3,
        albedo=image((0.25, 0.22, 0.15), (0.05, 0.06, 0.09)),
        clouds=image((0.7, 0.7, 0.7, 0.9), (0.7, 0.7, 0.7, 0.1)),
        atmosphere=8400.0,
        haze=(0.068, 0.097, 0.221),
    )
    scene: Scene = scenes.scene(scenes.target(*scenes.box()), camera=CAMERA, lights=[SUN])
    changed: Planet = replace(planet, **fields)  # type: ignore[arg-type]
    behind: Scene = replace(scene, environment=Environment(planets=(changed,)))
    return behind


def image(one: tuple[float, ...], other: tuple[float, ...]) -> Image:
    """A map of large patches of two colours."""
    rows, columns = np.indices((256, 512))
    which = ((rows // 37 + columns // 53) % 2)[..., None]
    pixels = np.ones((256, 512, 4), np.float32)
    pixels[..., : len(one)] = np.where(which, np.float32(one), np.float32(other))
    return Image(name="map", pixels=pixels)

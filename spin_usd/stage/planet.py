"""A planet: SpinPlanetAPI."""

from functools import lru_cache

import numpy as np
from pxr import Sdf, Usd

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.environment import Planet
from spin_usd.scene.texture import Color, Image
from spin_usd.stage import schema
from spin_usd.stage.images import Images
from spin_usd.stage.ranges import ABOVE_0, AT_LEAST_0, SHARE, value_in

CLEAR_AIR = 5.0  # scale heights above which less than a hundredth of the air is left


def read_planet(prim: Usd.Prim, time: Usd.TimeCode, T_cam_prim: Transform, metres: float, images: Images) -> Planet:
    """The planet at `time`; its unit is `metres`. Raises StageError, UnsupportedError with the planet's path."""
    a, b, c = (metres * radius for radius in value_in(prim, schema.PLANET_RADII, ABOVE_0, time))
    planet = Planet(
        path=str(prim.GetPath()),
        T_cam_planet=Transform(to="cam", of="planet", rotation=T_cam_prim.rotation, translation=T_cam_prim.translation),
        radii=(a, b, c),
        albedo=_albedo(prim, time, images),
        clouds=_clouds(prim, time, images),
        atmosphere=metres * value_in(prim, schema.PLANET_SCALE_HEIGHT, AT_LEAST_0, time),
        haze=value_in(prim, schema.PLANET_OPTICAL_DEPTH, AT_LEAST_0, time),
    )
    _check_place(planet)
    return planet


def refuse_hidden_target(planets: tuple[Planet, ...], target_cam: Float) -> None:
    """Raise UnsupportedError for a planet before the target's origin (3,), camera frame: pictures have it behind."""
    for planet in planets:
        turn, radii = planet.T_cam_planet.rotation.T, np.array(planet.radii)
        start, way = -(turn @ planet.T_cam_planet.translation) / radii, turn @ target_cam / radii
        a, b, c = way @ way, start @ way, start @ start - 1
        if b < 0 and b * b > a * c and c < -b + np.sqrt(b * b - a * c):
            raise UnsupportedError("hides the target", where=planet.path, do="put the target before it")


def _check_place(planet: Planet) -> None:
    """Raise UnsupportedError unless the camera is outside the planet and its air."""
    centre = planet.T_cam_planet.inverse().translation
    height = (np.linalg.norm(centre / planet.radii) - 1) * min(planet.radii)
    if height <= (CLEAR_AIR * planet.atmosphere if any(planet.haze) else 0):
        found = f"the camera is {height:.6g} m above it: inside it, or in its air"
        do = f"keep it more than {CLEAR_AIR:g} scale heights of the atmosphere above the surface"
        raise UnsupportedError(found, where=planet.path, do=do)


def _albedo(prim: Usd.Prim, time: Usd.TimeCode, images: Images) -> Image | Color:
    file = _file(prim, schema.PLANET_ALBEDO_FILE, time)
    if not file:
        r, g, b = value_in(prim, schema.PLANET_ALBEDO, SHARE, time)
        return float(r), float(g), float(b)
    image = images.read(file, "auto", prim).image
    if image.pixels[..., :3].min() < 0 or image.pixels[..., :3].max() > 1:
        found = f"its image {image.name} is no albedo: it holds numbers outside 0 to 1"
        raise StageError(found, where=prim.GetPath(), do="scale it")
    return image


def _clouds(prim: Usd.Prim, time: Usd.TimeCode, images: Images) -> Image | None:
    file = _file(prim, schema.PLANET_CLOUDS_FILE, time)
    if not file:
        return None
    r, g, b = value_in(prim, schema.PLANET_CLOUDS_ALBEDO, SHARE, time)
    return _cloud_image(images.read(file, "raw", prim).image, (float(r), float(g), float(b)))


@lru_cache(maxsize=4)
def _cloud_image(image: Image, albedo: Color) -> Image:
    """The clouds' albedo, with their opacity in alpha."""
    alpha = image.pixels[..., 3]
    opacity = image.pixels[..., 0] if alpha.min() == 1 else alpha
    pixels = np.empty(image.pixels.shape, np.float32)
    pixels[..., :3], pixels[..., 3] = albedo, np.clip(opacity, 0, 1)
    return Image(name=image.name, pixels=pixels)


def _file(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> Sdf.AssetPath | None:
    asset: Sdf.AssetPath | None = prim.GetAttribute(name).Get(time)
    return asset if asset and asset.path else None

"""A planet: SpinPlanetAPI, and the allowed colours of its images."""

from collections.abc import Mapping
from functools import lru_cache
from math import hypot
from types import MappingProxyType

import numpy as np
from pxr import Sdf, Usd

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.ellipsoid import meets_cone
from spin_usd.geometry.transform import Transform
from spin_usd.scene.environment import Planet
from spin_usd.scene.texture import Color, Image
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.emission import EMISSIONS
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import AT_LEAST_0, FINITE, SHARE, Range, read, typed_value, value_in

RADII = Range(1e-3, 1e10)  # metres: from a marble to a star of ten times the Sun's radius
MAX_AXIS_RATIO = 100  # times its shortest semi-axis; ten times as long as the longest body that was ever seen
SCALE_HEIGHTS = Range(1e-6, 1e9, or_0=True)  # metres: from a coat on such a marble to the air of such a star
MAX_SCALE_HEIGHT = 0.1  # scale height over its shortest semi-axis: air masses assume a shallow layer; Pluto has 0.05
OPTICAL_DEPTHS = Range(0, 1000)  # thirty times Venus's clouds, which are opaque
MAX_DISTANCE_M = 1e15  # the camera's distance from the planet: two hundred times as far as Neptune from the Sun
CLEAR_AIR = 5.0  # scale heights above which less than a hundredth of the air is left
COLOURS: Mapping[str, Range] = MappingProxyType(
    {schema.PLANET_ALBEDO_FILE: SHARE, schema.PLANET_NIGHT_FILE: AT_LEAST_0}
)
"""The linear red, green and blue that an image may hold, by the attribute that names its file."""


def read_planet(prim: Usd.Prim, time: Usd.TimeCode, T_cam_prim: Transform, metres: float, images: Images) -> Planet:
    """Read the planet at `time`; its unit is `metres`. Raises StageError, UnsupportedError with the planet's path."""
    a, b, c = _radii(prim, time, metres)
    planet = Planet(
        path=str(prim.GetPath()),
        T_cam_planet=Transform(to="cam", of="planet", rotation=T_cam_prim.rotation, translation=T_cam_prim.translation),
        radii=(a, b, c),
        albedo=_albedo(prim, time, images),
        clouds=_clouds(prim, time, images),
        night=_night(prim, time, images),
        night_radiance=_night_radiance(prim, time),
        atmosphere=_lengths(prim, schema.PLANET_SCALE_HEIGHT, SCALE_HEIGHTS, time, metres)[0],
        haze=value_in(prim, schema.PLANET_OPTICAL_DEPTH, OPTICAL_DEPTHS, time),
        illuminates=typed_value(prim, schema.PLANET_ILLUMINATES, time),
    )
    if planet.atmosphere > MAX_SCALE_HEIGHT * min(planet.radii):
        found = f"is {planet.atmosphere:g} m, more than {MAX_SCALE_HEIGHT:g} of the shortest semi-axis"
        raise StageError(found, where=f"{prim.GetPath()}.{schema.PLANET_SCALE_HEIGHT}", do="make it shallower")
    _check_position(planet)
    return planet


def refuse_hidden_target(planets: tuple[Planet, ...], target_cam: Float, radius: float) -> None:
    """Raise UnsupportedError for a planet that may cover a part of the target, or intersect it: renderers put the whole
    target before planets. The target lies in the sphere of `radius`, metres, around `target_cam` (3,), camera frame."""
    for planet in planets:
        T_planet_cam = planet.T_cam_planet.inverse()
        apex, centre = T_planet_cam.points(np.array([np.zeros(3), target_cam]))
        if meets_cone(np.array(planet.radii), apex, centre, radius):
            found = f"hides or cuts the target: it meets the sphere of {radius:.6g} m around it, or the view of that"
            raise UnsupportedError(found, where=planet.path, do="keep all of that sphere in front of the planet")


def _radii(prim: Usd.Prim, time: Usd.TimeCode, metres: float) -> tuple[float, float, float]:
    if read(prim.GetAttribute(schema.PLANET_RADII), time) is None:
        where = f"{prim.GetPath()}.{schema.PLANET_RADII}"
        raise StageError("is not authored", where=where, do="give the planet its semi-axes along x, y and z")
    a, b, c = _lengths(prim, schema.PLANET_RADII, RADII, time, metres)
    if max(a, b, c) > MAX_AXIS_RATIO * min(a, b, c):
        found = f"is ({a:g}, {b:g}, {c:g}) m, of which one is more than {MAX_AXIS_RATIO} times another"
        raise StageError(found, where=f"{prim.GetPath()}.{schema.PLANET_RADII}", do="make it rounder")
    return a, b, c


def _lengths(prim: Usd.Prim, name: str, allowed: Range, time: Usd.TimeCode, metres: float) -> tuple[float, ...]:
    """Read one or more lengths and convert them to metres; the prim's own unit is `metres`. Raises StageError where one
    is outside `allowed`."""
    value = value_in(prim, name, FINITE, time)
    found = tuple(metres * length for length in (value if isinstance(value, tuple) else (value,)))
    for length in found:
        if length not in allowed:
            raise StageError(f"is {length:g} m", where=f"{prim.GetPath()}.{name}", do=f"choose {allowed}, in metres")
    return found


def _check_position(planet: Planet) -> None:
    """Raise UnsupportedError unless the camera is outside the planet and its air, and not farther than
    MAX_DISTANCE_M."""
    centre = planet.T_cam_planet.inverse().translation
    far = hypot(*centre)
    if not far <= MAX_DISTANCE_M:
        found = f"is {far:g} m from the camera, more than {MAX_DISTANCE_M:g} m"
        raise UnsupportedError(found, where=planet.path, do="leave it out, or make it one of the stars")
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
    return _colour_image(prim, schema.PLANET_ALBEDO_FILE, file, images)


def _clouds(prim: Usd.Prim, time: Usd.TimeCode, images: Images) -> Image | None:
    file = _file(prim, schema.PLANET_CLOUDS_FILE, time)
    if not file:
        return None
    r, g, b = value_in(prim, schema.PLANET_CLOUDS_ALBEDO, SHARE, time)
    return _cloud_image(images.read(file, "raw", prim, upright=True).image, (float(r), float(g), float(b)))


@lru_cache(maxsize=4)
def _cloud_image(image: Image, albedo: Color) -> Image:
    """Return the clouds' albedo, with their opacity in alpha."""
    alpha = image.pixels[..., 3]
    opacity = image.pixels[..., 0] if alpha.min() == 1 else alpha
    pixels = np.empty(image.pixels.shape, np.float32)
    pixels[..., :3], pixels[..., 3] = albedo, np.clip(opacity, 0, 1)
    return Image(name=image.name, pixels=pixels)


def _night(prim: Usd.Prim, time: Usd.TimeCode, images: Images) -> Image | None:
    file = _file(prim, schema.PLANET_NIGHT_FILE, time)
    return _colour_image(prim, schema.PLANET_NIGHT_FILE, file, images) if file else None


def _colour_image(prim: Usd.Prim, attribute: str, file: Sdf.AssetPath, images: Images) -> Image:
    """Read the image that `attribute` names. Raises StageError for colours that it may not have."""
    image = images.read(file, "auto", prim, upright=True).image
    if found := colours_outside(image, attribute):
        do = f"make them {COLOURS[attribute]}"
        raise StageError(f"its image {image.name} {found}", where=f"{prim.GetPath()}.{attribute}", do=do)
    return image


def _night_radiance(prim: Usd.Prim, time: Usd.TimeCode) -> Color:
    """Return the radiance of white by night; 0 without an image of it, where it decides nothing."""
    if not _file(prim, schema.PLANET_NIGHT_FILE, time):
        return 0.0, 0.0, 0.0
    r, g, b = value_in(prim, schema.PLANET_NIGHT_RADIANCE, EMISSIONS, time)
    return float(r), float(g), float(b)


def _file(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> Sdf.AssetPath | None:
    asset: Sdf.AssetPath | None = read(prim.GetAttribute(name), time)
    return asset if asset and asset.path else None


def colours_outside(image: Image, attribute: str) -> str | None:
    """Return a phrase on the image's colours if some are outside the range of `attribute`; else None."""
    low, high = _extremes(image)
    allowed = COLOURS[attribute]
    return None if low in allowed and high in allowed else f"holds colours from {low:.3g} to {high:.3g}"


@lru_cache(maxsize=4)
def _extremes(image: Image) -> tuple[float, float]:
    """Return its least and its greatest colour. It is cached: a map of a planet has millions of pixels."""
    colours = image.extremes[:, :3]
    return float(colours.min()), float(colours.max())

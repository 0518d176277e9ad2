"""The background as linear radiance of every pixel: planets, stars, a dome, a back plate."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry import lens
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.renderers.background.dome import dome_radiance
from spin_usd.renderers.background.elementary import Float32
from spin_usd.renderers.background.enlarge import bilinear, repeated
from spin_usd.renderers.background.globe import Globe, Rays
from spin_usd.renderers.background.planet_light import planet_light
from spin_usd.renderers.background.planet_sunlight import suns_of_planets
from spin_usd.renderers.background.planet_view import Hidden, PlanetView
from spin_usd.scene.environment import BackPlate
from spin_usd.scene.light import DistantLight, DomeLight
from spin_usd.scene.scene import Scene
from spin_usd.scene.texture import Image

SMALL_PX = 8.0  # radius of a planet that is rendered ray by ray, not pixel by pixel
PLATE = 1  # separates this use of a picture's seed from others
WIDE = 0.7  # sine of a cone that is not worth bounding


def sky(scene: Scene, *, seed: int, hidden: Hidden = None) -> Float32 | None:
    """Return (H, W, 3) W/m2/sr, of the whole frame; None if all is black. `seed` chooses a back plate."""
    frame = np.zeros((*scene.camera.frame.shape, 3), np.float32)
    rendered = [
        _add_plate(scene, frame, seed) or _add_domes(scene, frame) + _add_stars(scene, frame),
        _add_planets(scene, frame, hidden),
    ]
    return frame if any(rendered) else None


def _add_plate(scene: Scene, frame: Float32, seed: int) -> int:
    plate = scene.environment.back_plate
    placed = plate and place_image(plate, seed)
    if not plate or not placed:
        return 0
    white = np.array(plate.radiance, np.float32)
    for band in scene.camera.frame.bands():
        image = plate_radiance(placed, scene.camera.frame, band)
        frame[band.slices] = np.stack(image, -1).reshape(*band.shape, 3) * white
    return 1


def _add_domes(scene: Scene, frame: Float32) -> int:
    domes = [light for light in scene.lights if isinstance(light, DomeLight) and any(light.radiance)]
    for dome in domes:
        if dome.image is None:
            frame += np.array(dome.radiance, np.float32)
            continue
        for band, rays in bands(scene.camera, scene.camera.frame):
            _add(frame, band, dome_radiance(dome, rays))
    return len(domes)


def _add_stars(scene: Scene, frame: Float32) -> int:
    """Stars behind planets too small for `_add_planets` to hide them pixel by pixel are skipped here."""
    small = [globe for globe in _globes(scene) if _is_small(scene, globe)]
    for stars in scene.environment.stars:
        directions, irradiance = stars.T_cam_sky.directions(stars.directions), stars.irradiance
        for globe in small:
            beside = directions @ globe.centre / globe.distance < np.sqrt(1 - globe.angular_radius_sine**2)
            directions, irradiance = directions[beside], irradiance[beside]
        splat(frame, scene.camera, directions, irradiance)
    return len(scene.environment.stars)


def _add_planets(scene: Scene, frame: Float32, hidden: Hidden) -> bool:
    """Add the planets to the frame, the farthest first, and return whether any is seen."""
    suns, seen = suns_of_planets(scene.lights), False
    for globe in sorted(_globes(scene), key=lambda globe: -globe.distance):
        if _is_small(scene, globe):
            _add_small(scene, frame, globe, suns)
            seen = True
        else:
            seen |= _add_globe(scene, frame, globe, suns, hidden)
    return seen


def _add_small(scene: Scene, frame: Float32, globe: Globe, suns: tuple[DistantLight, ...]) -> None:
    rays, irradiance = planet_light(globe, suns)
    splat(frame, scene.camera, np.stack([rays.x, rays.y, rays.z], -1), irradiance)


def _add_globe(scene: Scene, frame: Float32, globe: Globe, suns: tuple[DistantLight, ...], hidden: Hidden) -> bool:
    camera = scene.camera
    region = region_of_cone(camera, globe.centre / globe.distance, globe.angular_radius_sine)
    return not region.empty and PlanetView(camera, globe, suns, region).add_to(frame, hidden)


def _add(frame: Float32, band: Region, radiance: list[Float32]) -> None:
    part = frame[band.slices]
    for channel in range(3):
        part[..., channel] += radiance[channel].reshape(band.shape)


def _globes(scene: Scene) -> list[Globe]:
    return [Globe(planet=planet, eye=np.zeros(3)) for planet in scene.environment.planets]


def _is_small(scene: Scene, globe: Globe) -> bool:
    return bool(globe.angular_radius_sine * max(scene.camera.fx, scene.camera.fy) < SMALL_PX)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedImage:
    """An image placed behind one picture: mirrored, then rotated clockwise by `roll`, radians."""

    image: Image
    roll: float
    mirrored: bool


def place_image(plate: BackPlate, seed: int) -> PlacedImage | None:
    """Return the image of the back plate that the picture with this seed shows, None if it shows none."""
    there, which, turn, mirror = np.random.default_rng([seed, PLATE]).random(4)
    if there >= plate.probability:
        return None
    least, most = plate.roll
    image = plate.images[int(which * len(plate.images))]
    return PlacedImage(image=image, roll=least + turn * (most - least), mirrored=bool(mirror < plate.mirror))


def plate_radiance(placed: PlacedImage, frame: Region, band: Region) -> list[Float32]:
    """Return R, G, B (N,) of the image behind the pixels of `band`, in the same order; 1 is white.

    The image is as small as it can be without an edge in the frame, its middle in the frame's middle.
    """
    cos, sin = np.cos(placed.roll), np.sin(placed.roll)
    wide = frame.width * abs(cos) + frame.height * abs(sin)
    high = frame.width * abs(sin) + frame.height * abs(cos)
    rows, columns = placed.image.size
    scale = min(columns / wide, rows / high)  # of the image's pixels to the frame's
    tables = _reduced(placed.image, max(int(scale), 1))
    rows, columns = tables.shape[1] - 1, tables.shape[2] - 1
    scale = min(columns / wide, rows / high)
    x = np.arange(band.x0, band.x1) + 0.5 - frame.width / 2
    y = (np.arange(band.y0, band.y1) + 0.5 - frame.height / 2)[:, None]
    across = (x * cos + y * sin) * (-scale if placed.mirrored else scale) + columns / 2 - 0.5
    down = (y * cos - x * sin) * scale + rows / 2 - 0.5
    u, v = np.clip(across, 0, columns - 1), np.clip(down, 0, rows - 1)
    return bilinear(tables, u.ravel().astype(np.float32), v.ravel().astype(np.float32))


@lru_cache(maxsize=4)
def _reduced(image: Image, factor: int) -> Float32:
    """Return the image's R, G and B as tables, with the mean of each `factor` by `factor` pixels for one. Of the many
    that may lie behind pictures none is kept whole."""
    width = image.size[1] // factor
    left, means = np.empty((0, width * factor, 3), np.float32), []
    for band in image.bands():
        pixels = np.concatenate([left, band[:, : width * factor, :3]])
        rows = len(pixels) // factor
        left, whole = pixels[rows * factor :], pixels[: rows * factor]
        means.append(whole.reshape(rows, factor, width, factor, 3).mean((1, 3), dtype=np.float32))
    return repeated(np.moveaxis(np.concatenate(means), -1, 0))


def bands(camera: Camera, region: Region) -> Iterator[tuple[Region, Rays]]:
    """Yield the pixels of `region` in bands that fit a processor's cache, each with the rays (N,) through their
    centres."""
    for band in region.bands():
        yield band, Rays.through(camera, np.moveaxis(camera.centres(band), -1, 0).reshape(2, -1))


def solid_angles(camera: Camera, xy: Float) -> Float:
    """Return the solid angles (N,), sr, of the pixels around the undistorted normalised coordinates (N, 2)."""
    stretch = np.abs(np.linalg.det(lens.distortion_jacobian(xy, camera.distortion)))
    return np.asarray(1 / (camera.fx * camera.fy * stretch * (1 + (xy**2).sum(1)) ** 1.5))


def region_of_cone(camera: Camera, axis: Float, sine: float) -> Region:
    """Return the pixels that can see into the cone around `axis` (3,), unit, whose angular radius has the `sine`."""
    if sine > WIDE:
        return camera.frame
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    turn = np.linspace(0, 2 * np.pi, 65)[:, None]
    rim = np.sqrt(1 - sine**2) * axis + sine * (np.cos(turn) * across + np.sin(turn) * np.cross(axis, across))
    if (rim[:, 2] <= 0).all():
        return Region(x0=0, y0=0, x1=0, y1=0)
    pixels = camera.project(rim)
    if not np.isfinite(pixels).all():
        return camera.frame
    (x0, y0), (x1, y1) = np.floor(pixels.min(0)), np.ceil(pixels.max(0))
    # Between 64 points a circle bulges by a thousandth of its size.
    margin = 2 + int(0.01 * max(x1 - x0, y1 - y0))
    return Region(x0=int(x0), y0=int(y0), x1=int(x1), y1=int(y1)).padded(margin) & camera.frame


def splat(frame: Float32, camera: Camera, directions: Float, irradiance: Float) -> None:
    """Add points at infinity to the radiances `frame` (H, W, 3): directions (N, 3), unit; irradiance (N, 3) W/m2.

    Each lights the four pixels around it, so that its light and its centre are right wherever in a pixel it falls.
    """
    ahead = directions[:, 2] > 0
    xyz, light = directions[ahead], irradiance[ahead]
    field_radius = np.hypot(*camera.normalised(camera.rim(64)).T).max() * 1.02 + 2 / camera.fx
    near = np.hypot(xyz[:, 0], xyz[:, 1]) < field_radius * xyz[:, 2]
    xyz, light = xyz[near], light[near]
    uv = camera.project(xyz)
    seen = np.isfinite(uv).all(1)
    uv, light, xy = uv[seen], light[seen], xyz[seen, :2] / xyz[seen, 2:]
    radiance = light / solid_angles(camera, xy)[:, None]
    corner = np.floor(uv - 0.5)
    share = uv - 0.5 - corner
    for dy in (0, 1):
        for dx in (0, 1):
            weight = np.abs(1 - dx - share[:, 0]) * np.abs(1 - dy - share[:, 1])
            column, row = corner[:, 0] + dx, corner[:, 1] + dy
            inside = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
            at = row[inside].astype(int), column[inside].astype(int)
            np.add.at(frame, at, (weight[:, None] * radiance)[inside].astype(np.float32))

"""The background as linear radiance of every pixel: planets, stars, a dome, a back plate."""

import numpy as np

from spin_usd.geometry.region import Region
from spin_usd.renderers.background.arithmetic.elementary import Float32
from spin_usd.renderers.background.back_plate import place_image, plate_radiance
from spin_usd.renderers.background.dome import dome_radiance
from spin_usd.renderers.background.pixels import bands, region_of_cone, splat
from spin_usd.renderers.background.planet.globe import Globe
from spin_usd.renderers.background.planet.sunlight import suns_of_planets
from spin_usd.renderers.background.planet.view import Hidden, PlanetView
from spin_usd.renderers.background.planet_light import planet_light
from spin_usd.scene.light import DistantLight, DomeLight
from spin_usd.scene.model import Scene

SMALL_PX = 8.0  # radius of a planet that is rendered ray by ray, not pixel by pixel


def sky(scene: Scene, *, seed: int, hidden: Hidden = None) -> Float32 | None:
    """Return (H, W, 3) W/m2/sr, of the whole frame; None where nothing is there but black. `seed` chooses a back
    plate."""
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

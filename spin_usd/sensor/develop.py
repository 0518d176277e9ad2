"""Development of radiance into the image: the background is added, then come optics and detector."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.scene.model import Scene
from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.detector import collect, detect, without_noise
from spin_usd.sensor.exposure import exposed
from spin_usd.sensor.optics import through_optics


def develop(scene: Scene, radiance: Radiance, sky: NDArray[np.float32] | None, *, seed: int) -> NDArray[Any]:
    """Return the image of `scene`: (H, W) or (H, W, 3), uint8 or uint16.

    `sky` (H, W, 3): linear radiance of what lies behind the target, None where that is black.
    """
    sensor = exposed(scene.sensor, radiance)
    return detect(_collected(scene, sensor, radiance, sky), sensor, seed=seed)


def developed_without_noise(scene: Scene, radiance: Radiance, sky: NDArray[np.float32] | None) -> Float:
    """Return the image that `develop` makes, but without the detector's noise and before any rounding: (H, W) or (H, W,
    3), digital numbers."""
    sensor = exposed(scene.sensor, radiance)
    return without_noise(_collected(scene, sensor, radiance, sky), sensor)


def _collected(
    scene: Scene, sensor: Sensor, radiance: Radiance, sky: NDArray[np.float32] | None
) -> NDArray[np.float32]:
    """Return the light (H, W, C) that the detector's channels take in."""
    slices, rgba = radiance.region.slices, radiance.rgba
    front = collect(rgba[..., :3], sensor)
    if sky is None:
        light = np.zeros((*scene.camera.frame.shape, front.shape[-1]), np.float32)
        light[slices] = front
    else:
        light = collect(sky, sensor)
        light[slices] *= 1 - rgba[..., 3:]
        light[slices] += front
    return through_optics(light, scene.optics, scene.camera, exposure=sensor.exposure)

"""The optics: how lens and housing dim and spread light before the detector counts it. Everything but the artist's
bloom is linear in the light."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.geometry.camera import Camera
from spin_usd.scene.sensor import Optics
from spin_usd.sensor.bloom import bloom
from spin_usd.sensor.glare import scatter
from spin_usd.sensor.spread import convolved
from spin_usd.sensor.vignetting import vignetting_gain


def through_optics(
    light: NDArray[np.float32], optics: Optics, camera: Camera, *, exposure: float
) -> NDArray[np.float32]:
    """`light` (H, W, C) of the whole frame as it falls on the detector; the same array where the optics do nothing.

    `exposure` scales it to the unit range, in which bloom has its threshold.
    """
    image = light[..., 0] if light.shape[-1] == 1 else light
    gain = vignetting_gain(camera, optics)
    if gain is not None:
        image = image * (gain if image.ndim == 2 else gain[..., None])
    if optics.psf_sigma > 0:
        # Mirrored at the rim: as much comes in from beyond the frame as goes out, and no rim is dark.
        image = convolved(image, optics.psf_sigma**2, mirrored=True)
    if optics.glare > 0:
        image = scatter(image, optics)
    if optics.bloom_intensity > 0:
        image = bloom(image, optics, exposure)
    return image.reshape(light.shape)

"""The measures of a pair: our picture is made with the fits so far, and both are measured."""

import base64
from dataclasses import asdict, replace
from math import ceil, isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.commands.gap.calls import MeasuredPair, MeasurePair
from spin_usd.commands.gap.pair_studio import PairStudio, grey_of, linear_signal
from spin_usd.commands.gap.real_pictures import JPEG, read_grey
from spin_usd.errors import InputError
from spin_usd.formats.image_file import encoded_image
from spin_usd.picture.kinds import IMAGE
from spin_usd.picture.make_picture import Stopwatch, make_image
from spin_usd.realism.camera_fit import SIGMAS, sigma_of_spread
from spin_usd.realism.darkness import darkness, shot_noise
from spin_usd.realism.edges import SILHOUETTE_REACH, edge_spread
from spin_usd.realism.measures import compared, compared_parts, measured, silhouette
from spin_usd.realism.picture_view import FULL, PictureView
from spin_usd.realism.two_sample import patch_features
from spin_usd.renderers.background.sky import sky
from spin_usd.scene.derived.content_keys import background_seed
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.develop import developed_without_noise

SHOWN = 360  # pixels of the longer side
MARGIN = 0.15  # of the target's box around it
LEAST_TARGET = 200  # pixels
FAR_PX = 5.0  # of a silhouette's offsets, root mean square, beyond which the pose is in doubt
CLOSE_PX = 3.0  # to the end of the search for a silhouette, where offsets are too small
BELOW, LEAST_BELOW = 5.0, 0.002  # noises below the black level, and the share of pixels there that no room has
SIGMA_OF_MAD = 1.48  # a normal distribution's standard deviation over its median absolute deviation


def measured_pair(pictures: PairStudio, request: MeasurePair) -> MeasuredPair:
    """Make our picture of a pair with the fits so far, and measure both. Raises InputError for a real picture that
    cannot be compared."""
    scene = pictures.scene(request.pair, request.fitted)
    watch, settings = Stopwatch(), pictures.studio.settings
    file = Path(request.pair.file)
    grey, by, notes = read_grey(file, (scene.camera.width, scene.camera.height))
    parts = pictures.parts(scene)
    if (parts > 0).sum() < LEAST_TARGET:
        do = "leave the picture out, or correct its pose"
        raise InputError(f"shows {(parts > 0).sum()} pixels of the target", where=file, do=do)
    radiance = pictures.radiance(scene)
    _, image, _ = next(make_image(scene, radiance, settings, (IMAGE,), watch, {}))
    real, ours = (PictureView(grey=each, parts=parts) for each in (grey, grey_of(image, scene.sensor)))
    offsets = silhouette(real)
    if (off := float(np.hypot(offsets.median, SIGMA_OF_MAD * offsets.spread))) > FAR_PX:
        about = "at least" if off > SILHOUETTE_REACH - CLOSE_PX else "about"
        notes.append(f"its edges are {about} {off:.1f} px from the target's: check its pose, camera and model")
    if (grey < real.darkness.level - max(BELOW * real.darkness.noise, 1.0)).mean() > LEAST_BELOW:
        notes.append("shows no dark room: black level and noise are of the darkest that it shows")
    sigma = _sharpness(pictures, scene, radiance, real) if request.sharpness else float("nan")
    return MeasuredPair(
        real=_finite(measured(real, real)),
        ours=_finite(measured(ours, real)),
        both=_finite(compared(real, ours)),
        parts={name: _finite(of) for name, of in compared_parts(real, ours, pictures.part_names(scene))},
        silhouette=_finite(asdict(offsets)),
        linear=_finite(_linear_noise(real, scene.sensor)),
        own_pose=pictures.has_own_pose(request.pair, scene),
        jpeg=by == 1 and file.suffix.lower() in JPEG and 2 * real.darkness.borders < real.darkness.across,
        psf_sigma=sigma if isfinite(sigma) else None,
        own_psf=scene.optics.psf_sigma,
        real_features=patch_features(real).tolist(),
        our_features=patch_features(ours).tolist(),
        shown=[_shown(each, parts) for each in (real.grey, ours.grey)],
        notes=notes,
    )


def _sharpness(pictures: PairStudio, scene: Scene, radiance: Radiance, real: PictureView) -> float:
    """Return the psf_sigma at which our edges are as sharp as the real ones, both in the real picture's noise."""
    behind = sky(scene, seed=background_seed(scene, pictures.studio.settings))
    within, noise = real.edge_places, real.darkness.noise
    shot = max(np.nan_to_num(shot_noise(real.grey, real.darkness)), 0.0)
    chance = np.random.default_rng(0).standard_normal(real.grey.shape).astype(np.float32)
    spreads = []
    for sigma in SIGMAS:
        blurred = replace(scene, optics=replace(scene.optics, psf_sigma=sigma))
        ours = grey_of(developed_without_noise(blurred, radiance, behind), scene.sensor)
        deviation = np.sqrt(np.float32(noise**2) + np.float32(shot) * ours)
        spreads.append(edge_spread(np.clip(ours + deviation * chance, 0, FULL), within, noise))
    return sigma_of_spread(edge_spread(real.grey, within, noise), spreads)


def _linear_noise(real: PictureView, sensor: Sensor) -> dict[str, float]:
    """Return the level and noise of a picture's linear signal, steps of 8 bits."""
    low, high = FULL * linear_signal(np.array((-0.5, 0.5)) + real.darkness.level, sensor)
    linear = np.asarray(FULL * linear_signal(real.grey, sensor), np.float32)
    dark = darkness(linear, rounding=float(high - low) ** 2 / 12)
    return {"level": dark.level, "noise": dark.noise, "shot_noise": shot_noise(linear, dark)}


def _shown(grey: NDArray[np.float32], parts: NDArray[Any]) -> str:
    """Return the target's surroundings as a JPEG in base64."""
    import cv2

    rows, columns = np.nonzero(parts)
    pad = ceil(MARGIN * max(np.ptp(rows), np.ptp(columns)))
    crop = grey[
        max(rows.min() - pad, 0) : rows.max() + pad + 1,
        max(columns.min() - pad, 0) : columns.max() + pad + 1,
    ]
    factor = min(SHOWN / max(crop.shape), 1)
    size = (max(round(crop.shape[1] * factor), 1), max(round(crop.shape[0] * factor), 1))
    small = cv2.resize(crop, size, interpolation=cv2.INTER_AREA)
    image = np.rint(np.clip(small, 0, FULL)).astype(np.uint8)
    return base64.b64encode(encoded_image(image, ".jpg", channels=("Y",))).decode()


def _finite(values: dict[str, Any]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items() if isfinite(value)}

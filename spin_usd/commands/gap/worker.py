"""The child's part of `gap`: pairs of a real picture and ours, measured; trials of materials; and the written fits."""

import base64
from dataclasses import asdict, replace
from math import ceil, inf, isfinite, log
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from spin_usd.commands.gap.calls import (
    FitLight,
    Fitted,
    LightAnswer,
    MeasuredPair,
    MeasurePair,
    OpenedGap,
    OpenGap,
    Pair,
    ShownMaterial,
    SurfaceErrors,
    TrySurfaces,
    WriteFits,
)
from spin_usd.commands.gap.pair_light import PairLight
from spin_usd.commands.gap.pair_studio import PairStudio, grey_of, linear_signal
from spin_usd.commands.gap.real_pictures import JPEG, read_grey
from spin_usd.errors import InputError
from spin_usd.formats.image_file import encoded_image
from spin_usd.picture.kinds import IMAGE
from spin_usd.picture.make_picture import Stopwatch, make_image
from spin_usd.processes.processors import hold_to
from spin_usd.realism.camera_fit import SIGMAS, sigma_of_spread
from spin_usd.realism.darkness import darkness, shot_noise
from spin_usd.realism.edges import edge_spread
from spin_usd.realism.measures import compared, compared_parts, measured, silhouette
from spin_usd.realism.picture_view import FULL, PictureView
from spin_usd.realism.surface_fit import INPUTS
from spin_usd.realism.two_sample import patch_features
from spin_usd.renderers.background.sky import sky
from spin_usd.scene.derived.content_keys import background_seed
from spin_usd.scene.derived.lookup import extremes
from spin_usd.scene.material import LIMITS, ROUNDING, Material
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import Sensor
from spin_usd.scene.texture import Primvar, Texture
from spin_usd.sensor.develop import developed_without_noise
from spin_usd.stage.augment.fitted_stage import FittedPicture, write_fits
from spin_usd.studio.picture_request import PictureRequest

SHOWN = 360  # pixels of the longer side
MARGIN = 0.15  # of the target's box around it
LEAST_TARGET = 200  # pixels
FAR_PX = 5.0  # of a silhouette's offsets, root mean square, beyond which the pose is in doubt
SIGMA_OF_MAD = 1.48  # a normal distribution's standard deviation over its median absolute deviation


class GapWorker:
    """A stage that is open, with a studio."""

    opened: OpenedGap

    def __init__(self, request: OpenGap) -> None:
        hold_to(request.cpus)
        self._pictures = PairStudio(request.stage, request.variant, request.settings)
        self._studio, self._light = self._pictures.studio, PairLight(self._pictures)
        reader = self._pictures.stage.reader()
        sensor = reader.scene(reader.frames[0]).sensor
        self.opened = OpenedGap(frames=[each.name for each in reader.frames], sensor=sensor)

    def measure(self, request: MeasurePair) -> MeasuredPair:
        """Make our picture of a pair with the fits so far, and measure both. Raises InputError for a real picture that
        cannot be compared."""
        scene = self._pictures.scene(request.pair, request.fitted)
        watch, settings = Stopwatch(), self._studio.settings
        file = Path(request.pair.file)
        grey, by, notes = read_grey(file, (scene.camera.width, scene.camera.height))
        parts = self._pictures.parts(scene)
        if (parts > 0).sum() < LEAST_TARGET:
            do = "leave the picture out, or correct its pose"
            raise InputError(f"shows {(parts > 0).sum()} pixels of the target", where=file, do=do)
        radiance = self._pictures.radiance(scene)
        _, image, _ = next(make_image(scene, radiance, settings, (IMAGE,), watch, {}))
        real, ours = (PictureView(grey=each, parts=parts) for each in (grey, grey_of(image, scene.sensor)))
        offsets = silhouette(real)
        if (off := float(np.hypot(offsets.median, SIGMA_OF_MAD * offsets.spread))) > FAR_PX:
            notes.append(f"its edges are about {off:.1f} px from the target's: check its pose, camera and model")
        sigma = self._sharpness(scene, radiance, real) if request.sharpness else float("nan")
        return MeasuredPair(
            real=_finite(measured(real, real)),
            ours=_finite(measured(ours, real)),
            both=_finite(compared(real, ours)),
            parts={name: _finite(of) for name, of in compared_parts(real, ours, self._pictures.part_names(scene))},
            silhouette=_finite(asdict(offsets)),
            linear=_finite(_linear_noise(real, scene.sensor)),
            jpeg=by == 1 and file.suffix.lower() in JPEG,
            psf_sigma=sigma if isfinite(sigma) else None,
            own_psf=scene.optics.psf_sigma,
            real_features=patch_features(real).tolist(),
            our_features=patch_features(ours).tolist(),
            shown=[_shown(each, parts) for each in (real.grey, ours.grey)],
            notes=notes,
        )

    def fit_light(self, request: FitLight) -> LightAnswer:
        """Fit the light of a real picture. Raises InputError as `measure` does."""
        return self._light.fit(request)

    def shown_materials(self, pair: Pair) -> dict[str, ShownMaterial]:
        """Count the pixels of each material of the first target in a picture."""
        scene = self._pictures.scene(pair, Fitted()).one_body_scenes[0]
        visible, target = self._studio.caster.visibility(scene), scene.bodies[0].target
        materials = target.mesh.face_material[visible.face[visible.face >= 0]]
        counts = np.bincount(materials, minlength=len(target.materials))
        return {
            material.path.rpartition("/")[2]: ShownMaterial(pixels=int(count), limits=_factor_limits(material))
            for material, count in zip(target.materials, counts, strict=True)
            if count and material.path
        }

    def try_surfaces(self, request: TrySurfaces) -> SurfaceErrors:
        """Fit the light of a picture anew with the values of each trial. Raises InputError as `measure` does."""
        errors = []
        for trial in request.trials:
            fitted = structs.replace(request.fitted, values=trial)
            asked = FitLight(pair=request.pair, fitted=fitted, psf_sigma=request.psf_sigma)
            errors.append(1 - self._light.fit(asked).explained)
        return SurfaceErrors(errors=errors)

    def write_fits(self, request: WriteFits) -> str:
        """Write the fits as layers over a copy of the stage; return its root layer. Raises OutputError, and
        UnsupportedError for lights that cannot be written."""
        pictures = [
            FittedPicture(
                frame=self._pictures.stage.frame(PictureRequest(frame=each.pair.frame)),
                scene=self._pictures.scene(each.pair, structs.replace(each.fitted, values={})),
            )
            for each in request.pictures
        ]
        root, folder = Path(self._pictures.stage.path), Path(request.folder)
        return str(write_fits(root, folder, pictures, fits=request.fits, values=request.values))

    def _sharpness(self, scene: Scene, radiance: Radiance, real: PictureView) -> float:
        """Return the psf_sigma at which our edges are as sharp as the real ones, both in the real picture's noise."""
        behind = sky(scene, seed=background_seed(scene, self._studio.settings))
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


def _factor_limits(material: Material) -> dict[str, tuple[float, float]]:
    """Return the limits of the logarithms of factors on a material's inputs, of those that can be changed."""
    found = {}
    for name, field in INPUTS.items():
        value, own = getattr(material, field), LIMITS[field]
        if isinstance(value, Primvar):
            most = 1.0
        else:
            most = float(extremes(value).max()) if isinstance(value, Texture) else float(np.max(value))
        if most > 0:
            found[name] = (log(own.low / most) if own.low else -inf, log(max(own.high - ROUNDING, most) / most))
    return found


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

"""The child's part of `gap`: pairs of a real picture and ours, measured, and the light of a real picture fitted."""

import base64
from collections.abc import Collection
from dataclasses import asdict, replace
from math import ceil, inf, isfinite, log
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.commands.gap.calls import (
    FitLight,
    Fitted,
    FittedLight,
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
from spin_usd.commands.gap.real_pictures import pooled, read_grey
from spin_usd.errors import InputError
from spin_usd.formats.image_file import encoded_image
from spin_usd.picture.kinds import IMAGE
from spin_usd.picture.make_picture import Stopwatch, make_image, make_labels
from spin_usd.processes.processors import hold_to
from spin_usd.realism.camera_fit import SIGMAS, fitted_optics, fitted_sensor, sigma_of_spread
from spin_usd.realism.darkness import darkness, shot_noise
from spin_usd.realism.edges import edge_spread
from spin_usd.realism.light_fit import LightFit, fit_light
from spin_usd.realism.measures import compared, compared_parts, measured, silhouette
from spin_usd.realism.panels import light_around, light_towards, names_around, names_near, scaled
from spin_usd.realism.picture_view import FULL, SATURATED, Mask, PictureView, eroded, smoothed
from spin_usd.realism.surface_fit import INPUTS as FITTED_INPUTS
from spin_usd.realism.two_sample import patch_features
from spin_usd.renderers.background.sky import sky
from spin_usd.renderers.downscale import reduced
from spin_usd.scene.derived.content_keys import background_seed
from spin_usd.scene.derived.light_groups import LightGroups, in_unit_light
from spin_usd.scene.derived.lookup import extremes
from spin_usd.scene.light import Light
from spin_usd.scene.material import LIMITS, ROUNDING, Material
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import LUMINANCE, Sensor
from spin_usd.scene.texture import Primvar, Texture
from spin_usd.sensor.develop import developed_without_noise, light_on_detector
from spin_usd.sensor.tone import unrounded
from spin_usd.stage.augment.fitted_stage import FittedPicture, write_fits
from spin_usd.studio.open_stage import OpenStage
from spin_usd.studio.picture_request import PictureRequest
from spin_usd.studio.studio import Studio

FIT_PIXELS = 16000  # of the target's outline in a render that light is fitted to: more change no strength
REFINED = 4  # strongest lights of a first fit, near which others are tried
FIT_SMOOTHING_PX = 1.0  # of that render
FIT_EDGE_PX = 2  # of it
INNER = 0.3  # of the target's pixels that are not at its edge, or all count
SHOWN = 360  # pixels of the longer side
MARGIN = 0.15  # of the target's box around it
LEAST_TARGET = 200  # pixels
FAR_PX = 5.0  # of a silhouette's offsets, root mean square, beyond which the pose is in doubt
SIGMA_OF_MAD = 1.48  # a normal distribution's standard deviation over its median absolute deviation
CHUNK = 64  # images that OpenCV filters at once


class GapWorker:
    """A stage that is open, with a studio."""

    def __init__(self, request: OpenGap) -> None:
        hold_to(request.cpus)
        self._stage, self._studio = OpenStage(request.stage, variant=request.variant), Studio(request.settings)
        self._studio.open_renderer()
        reader = self._stage.reader()
        sensor = reader.scene(reader.frames[0]).sensor
        self.opened = OpenedGap(frames=[each.name for each in reader.frames], sensor=sensor)

    def measure(self, request: MeasurePair) -> MeasuredPair:
        """Make our picture of a pair with the fits so far, and measure both. Raises InputError for a real picture that
        cannot be compared."""
        scene = self._scene(request.pair, request.fitted)
        watch, settings = Stopwatch(), self._studio.settings
        grey, notes = read_grey(Path(request.pair.file), (scene.camera.width, scene.camera.height))
        parts = self._parts(scene)
        if (parts > 0).sum() < LEAST_TARGET:
            do = "leave the picture out, or correct its pose"
            raise InputError(f"shows {(parts > 0).sum()} pixels of the target", where=request.pair.file, do=do)
        radiance = self._radiance(scene)
        _, image, _ = next(make_image(scene, radiance, settings, (IMAGE,), watch, {}))
        real, ours = (PictureView(grey=each, parts=parts) for each in (grey, _grey(image, scene.sensor)))
        offsets = silhouette(real)
        if (off := float(np.hypot(offsets.median, SIGMA_OF_MAD * offsets.spread))) > FAR_PX:
            notes.append(f"its edges are about {off:.1f} px from the target's: check its pose, camera and model")
        sigma = self._sharpness(scene, radiance, real) if request.sharpness else float("nan")
        return MeasuredPair(
            real=_finite(measured(real, real)),
            ours=_finite(measured(ours, real)),
            both=_finite(compared(real, ours)),
            parts={name: _finite(of) for name, of in compared_parts(real, ours, self._part_names(scene))},
            silhouette=_finite(asdict(offsets)),
            linear=_finite(_linear_noise(real, scene.sensor)),
            psf_sigma=sigma if isfinite(sigma) else None,
            own_psf=scene.optics.psf_sigma,
            real_features=patch_features(real).tolist(),
            our_features=patch_features(ours).tolist(),
            shown=[_shown(each, parts) for each in (real.grey, ours.grey)],
            notes=notes,
        )

    def fit_light(self, request: FitLight) -> LightAnswer:
        """Fit the light of a real picture: of all candidates first, then of those near the strongest. Raises InputError
        as `measure` does."""
        fitted, panels = request.fitted, request.fitted.panels
        scene = self._scene(request.pair, structs.replace(fitted, lights=None))
        optics = scene.optics if request.psf_sigma is None else replace(scene.optics, psf_sigma=request.psf_sigma)
        scene = replace(scene, sensor=replace(scene.sensor, auto_exposure=None), optics=optics)
        grey, _ = read_grey(Path(request.pair.file), (scene.camera.width, scene.camera.height))
        found = self._fit_among(scene, grey, panels, fitted.lights)
        if panels and fitted.lights is None:
            strongest = [light.path for light in found.lights[:REFINED]]
            near = (name for each in strongest for name in names_near(each))
            found = self._fit_among(scene, grey, panels, (*(light.path for light in found.lights), *near))
        return found

    def shown_materials(self, pair: Pair) -> dict[str, ShownMaterial]:
        """Count the pixels of each material of the first target in a picture."""
        scene = self._scene(pair, Fitted()).one_body_scenes[0]
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
            errors.append(1 - self.fit_light(asked).explained)
        return SurfaceErrors(errors=errors)

    def write_fits(self, request: WriteFits) -> str:
        """Write the fits as layers over a copy of the stage; return its root layer. Raises OutputError, and
        UnsupportedError for lights that cannot be written."""
        pictures = [
            FittedPicture(
                frame=self._stage.frame(PictureRequest(frame=each.pair.frame)),
                scene=self._scene(each.pair, structs.replace(each.fitted, values={})),
            )
            for each in request.pictures
        ]
        root, folder = Path(self._stage.path), Path(request.folder)
        return str(write_fits(root, folder, pictures, fits=request.fits, values=request.values))

    def _fit_among(
        self, whole: Scene, grey: NDArray[np.float32], panels: int, names: Collection[str] | None
    ) -> LightAnswer:
        """Fit the light of the real picture `grey` (H, W) by the lights of these names."""
        by = max(ceil((whole.outline_pixels / FIT_PIXELS) ** 0.5), 1)
        optics = replace(whole.optics, psf_sigma=whole.optics.psf_sigma / by)
        lights = _candidates(whole, panels, names)
        scene = replace(reduced(replace(whole, lights=lights), by), optics=optics)
        size, mask = (scene.camera.height, scene.camera.width), self._parts(scene) > 0
        groups = LightGroups.of(scene)
        basis = np.stack([self._basis(scene, seed) for seed in (0, 1)])
        level = darkness(grey).level
        black, other = _linear(np.array(level), whole.sensor), basis[:, len(groups.placed) :].sum(1).mean(0)
        signal = pooled(np.asarray(_linear(grey, whole.sensor) - black, np.float32), by, size) - other
        full = (pooled(np.asarray(grey >= SATURATED, np.float32), by, size) > 0) & mask
        basis = np.stack([_smoothed_in(mask, each[: len(groups.placed)]) for each in basis])
        signal = _smoothed_in(mask, signal[None])[0]
        inner = eroded(mask, FIT_EDGE_PX)  # the edge has another sharpness, and another place if the pose is off
        used = inner if inner.sum() > INNER * mask.sum() else mask
        fit, counted = fit_light(basis, signal, used, full, sparse=panels > 0), used & ~full
        mean = basis.mean(0)
        squared = float(np.square(signal[counted], dtype=np.float64).sum())
        error = signal[counted] - np.tensordot(fit.strengths, mean[:, counted], 1)
        given = fit.strengths * mean[:, mask].sum(1, dtype=np.float64)
        shares = given / max(float(given.sum()), 1e-12)
        return LightAnswer(
            lights=[
                _fitted_light(scene, groups.placed[n], fit, n, float(shares[n]))
                for n in np.argsort(-shares, kind="stable").tolist()
                if fit.strengths[n] > 0
            ],
            explained=1 - float(np.square(error).sum()) / squared if squared else 0.0,
            squared=squared,
        )

    def _basis(self, scene: Scene, number: int) -> NDArray[np.float32]:
        """Return (N, H, W) the light of each group on the detector; `number`: of the render, with half the samples and
        noise of its own."""
        own, unit = self._studio.settings, in_unit_light(scene)
        effort = replace(own.effort, samples=max(own.effort.samples // 2, 1))
        settings = replace(own, effort=effort, seed=own.seed + number)
        render = self._studio.maker.render(unit, settings, Stopwatch())
        return np.stack(
            [
                light_on_detector(scene, replace(render, groups=group[None] * np.array(gain, np.float32)), None)
                for group, gain in zip(render.groups, unit.gains, strict=True)
            ]
        )

    def _scene(self, pair: Pair, fitted: Fitted) -> Scene:
        """Read the scene of a pair, with the fits so far."""
        request = PictureRequest(
            frame=pair.frame,
            poses={} if pair.pose is None else {"": pair.pose},
            name=pair.name if pair.pose else None,
            values=dict(fitted.values),
        )
        scene = self._stage.scene(request)
        if fitted.lights is not None:
            lights = tuple(
                scaled(light, fitted.lights[light.path])
                for light in _candidates(scene, fitted.panels, tuple(fitted.lights))
            )
            scene = replace(scene, lights=lights, sensor=replace(scene.sensor, auto_exposure=None))
        if fitted.camera is not None:
            sensor = fitted_sensor(scene.sensor, fitted.camera, fitted.level)
            sensor = sensor if fitted.lights is not None else replace(sensor, auto_exposure=scene.sensor.auto_exposure)
            scene = replace(scene, sensor=sensor, optics=fitted_optics(scene.optics, fitted.camera))
        return scene

    def _radiance(self, scene: Scene) -> Radiance:
        return self._studio.maker.radiance(scene, self._studio.settings, Stopwatch())

    def _parts(self, scene: Scene) -> NDArray[Any]:
        """Return (H, W) the part ids of the labels."""
        caster = self._studio.caster
        _, parts, _ = next(make_labels(scene, caster, ("segmentation",), Stopwatch(), caster))
        return parts

    def _part_names(self, scene: Scene) -> dict[int, str]:
        return {
            offset + number: part.name
            for body, offset in zip(scene.bodies, scene.part_offsets, strict=True)
            for number, part in enumerate(body.target.parts, 1)
        }

    def _sharpness(self, scene: Scene, radiance: Radiance, real: PictureView) -> float:
        """Return the psf_sigma at which our edges are as sharp as the real ones, both in the real picture's noise."""
        behind = sky(scene, seed=background_seed(scene, self._studio.settings))
        within, noise = real.edge_places, real.darkness.noise
        shot = max(np.nan_to_num(shot_noise(real.grey, real.darkness)), 0.0)
        chance = np.random.default_rng(0).standard_normal(real.grey.shape).astype(np.float32)
        spreads = []
        for sigma in SIGMAS:
            blurred = replace(scene, optics=replace(scene.optics, psf_sigma=sigma))
            ours = _grey(developed_without_noise(blurred, radiance, behind), scene.sensor)
            deviation = np.sqrt(np.float32(noise**2) + np.float32(shot) * ours)
            spreads.append(edge_spread(np.clip(ours + deviation * chance, 0, FULL), within, noise))
        return sigma_of_spread(edge_spread(real.grey, within, noise), spreads)


def _candidates(scene: Scene, panels: int, names: Collection[str] | None) -> tuple[Light, ...]:
    """Return the lights of these names that may shine: panels and Suns around the first target, or the scene's own."""
    if not panels:
        return tuple(light for light in scene.lights if names is None or light.path in names)
    centre, radius = _centre(scene), scene.bodies[0].target.mesh.radius
    return tuple(light_around(name, centre, radius, panels) for name in names or names_around(panels))


def _fitted_light(scene: Scene, index: int, fit: LightFit, place: int, share: float) -> FittedLight:
    direction, distance = light_towards(scene.lights[index], _centre(scene))
    return FittedLight(
        path=scene.lights[index].path,
        strength=float(fit.strengths[place]),
        low=float(fit.low[place]),
        high=float(fit.high[place]),
        share=share,
        direction=direction.tolist(),
        distance=distance,
    )


def _factor_limits(material: Material) -> dict[str, tuple[float, float]]:
    """Return the limits of the logarithms of factors on a material's inputs, of those that can be changed."""
    found = {}
    for name, field in FITTED_INPUTS.items():
        value, own = getattr(material, field), LIMITS[field]
        if isinstance(value, Primvar):
            most = 1.0
        else:
            most = float(extremes(value).max()) if isinstance(value, Texture) else float(np.max(value))
        if most > 0:
            found[name] = (log(own.low / most) if own.low else -inf, log(max(own.high - ROUNDING, most) / most))
    return found


def _centre(scene: Scene) -> Float:
    first = scene.bodies[0]
    return first.T_cam_body.points(first.target.mesh.centre)


def _linear(grey: NDArray[Any], sensor: Sensor) -> Float:
    """Return the linear signal, 0 to 1, of grey in steps of 8 bits, as a detector of one channel writes it."""
    signal = np.linspace(0, 1, 4096)
    mono = replace(sensor, channels="mono", bit_depth=8)
    found: Float = np.interp(grey, unrounded(signal[:, None], mono)[:, 0], signal)
    return found


def _linear_noise(real: PictureView, sensor: Sensor) -> dict[str, float]:
    """Return the level and noise of a picture's linear signal, steps of 8 bits."""
    low, high = FULL * _linear(np.array((-0.5, 0.5)) + real.darkness.level, sensor)
    linear = np.asarray(FULL * _linear(real.grey, sensor), np.float32)
    dark = darkness(linear, rounding=float(high - low) ** 2 / 12)
    return {"level": dark.level, "noise": dark.noise, "shot_noise": shot_noise(linear, dark)}


def _grey(image: NDArray[Any], sensor: Sensor) -> NDArray[np.float32]:
    """Return a written picture (H, W) or (H, W, 3) in steps of 8 bits."""
    grey = image if image.ndim == 2 else image @ np.array(LUMINANCE)
    return np.asarray(grey * (FULL / (2**sensor.bit_depth - 1)), np.float32)


def _smoothed_in(mask: Mask, images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return images (N, H, W) smoothed over the mask's pixels alone: what is behind the target does not count."""
    weight = np.maximum(smoothed(mask.astype(np.float32), FIT_SMOOTHING_PX), 1e-3)
    planes = np.moveaxis(images * mask, 0, -1)
    pieces = np.array_split(planes, max(ceil(planes.shape[-1] / CHUNK), 1), axis=-1)
    soft = [smoothed(np.ascontiguousarray(p), FIT_SMOOTHING_PX).reshape(p.shape) / weight[..., None] for p in pieces]
    return np.ascontiguousarray(np.moveaxis(np.concatenate(soft, -1), -1, 0))


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

"""The light of a real picture, fitted by renders of the lights that may shine."""

from collections.abc import Collection
from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.commands.gap.calls import FitLight, FittedLight, LightAnswer
from spin_usd.commands.gap.pair_studio import PairStudio, candidates, centre_of, linear_signal
from spin_usd.commands.gap.real_pictures import pooled, read_grey
from spin_usd.errors import InputError
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.realism.darkness import darkness
from spin_usd.realism.light_fit import LightFit, fit_light
from spin_usd.realism.panels import is_wall, light_towards, names_near
from spin_usd.realism.picture_view import SATURATED, Mask, dilated, eroded, smoothed_in
from spin_usd.renderers.downscale import reduced
from spin_usd.scene.derived.light_groups import LightGroups, in_unit_light
from spin_usd.scene.scene import Scene
from spin_usd.sensor.develop import light_on_detector

FIT_PIXELS = 16000  # of the target's outline in a render that light is fitted to: more change no strength
REFINED = 4  # strongest lights of a first fit, near which others are tried
FIT_SMOOTHING_PX = 1.0  # of that render
FIT_EDGE_PX = 2  # of it
INNER = 0.3  # of the target's pixels that are not at its edge, or all count
LEAST_SHARE = 1e-4  # of a picture's light: less is not listed
TINY = 1e-12  # of a squared signal
CHUNK = 64  # images that OpenCV filters at once


class PairLight:
    """Fits the light of real pictures."""

    def __init__(self, pictures: PairStudio) -> None:
        self._pictures = pictures

    def fit(self, request: FitLight) -> LightAnswer:
        """Fit the light of a real picture: of all candidates first, then of those near the strongest. Raises InputError
        as `measure` does."""
        answer, _ = self._fit(request)
        if not answer.lights:
            do = "leave the picture out"
            raise InputError("shows no light that could be fitted", where=request.pair.file, do=do)
        return answer

    def residuals(self, request: FitLight) -> Float:
        """Return (2, N) the light of the pixels that count which the fit leaves, in two renders with other noise; over
        the root of the squared signal. Raises InputError as `measure` does."""
        answer, error = self._fit(request)
        return np.asarray(error / max(answer.squared, TINY) ** 0.5)

    def _fit(self, request: FitLight) -> tuple[LightAnswer, Float]:
        fitted, panels = request.fitted, request.fitted.panels
        scene = self._pictures.scene(request.pair, structs.replace(fitted, lights=None))
        optics = scene.optics if request.psf_sigma is None else replace(scene.optics, psf_sigma=request.psf_sigma)
        scene = replace(scene, sensor=replace(scene.sensor, auto_exposure=None), optics=optics)
        grey, _, _ = read_grey(Path(request.pair.file), (scene.camera.width, scene.camera.height))
        found, error = self._fit_among(scene, grey, panels, fitted.lights)
        if panels and fitted.lights is None and found.lights:
            strongest = [light.path for light in found.lights if not is_wall(light.path)][:REFINED]
            near = (name for each in strongest for name in names_near(each))
            names = (*(light.path for light in found.lights), *near)
            found, error = self._fit_among(scene, grey, panels, names)
        return found, error

    def _fit_among(
        self, whole: Scene, grey: NDArray[np.float32], panels: int, names: Collection[str] | None
    ) -> tuple[LightAnswer, Float]:
        """Fit the light of the real picture `grey` (H, W) by the lights of these names; return it, and (2, N) what it
        leaves of the pixels that count."""
        by = max(ceil((whole.outline_pixels / FIT_PIXELS) ** 0.5), 1)
        optics = replace(whole.optics, psf_sigma=whole.optics.psf_sigma / by)
        lights = candidates(whole, panels, names)
        scene = replace(reduced(replace(whole, lights=lights), by), optics=optics)
        size, mask = (scene.camera.height, scene.camera.width), self._pictures.parts(scene) > 0
        groups = LightGroups.of(scene)
        basis = np.stack([self._basis(scene, seed) for seed in (0, 1)])
        level = darkness(grey).level
        black, other = linear_signal(np.array(level), whole.sensor), basis[:, len(groups.placed) :].sum(1).mean(0)
        signal = pooled(np.asarray(linear_signal(grey, whole.sensor) - black, np.float32), by, size) - other
        full = dilated(pooled(np.asarray(grey >= SATURATED, np.float32), by, size) > 0, FIT_EDGE_PX) & mask
        basis = np.stack([_smoothed_in(mask, each[: len(groups.placed)]) for each in basis])
        signal = _smoothed_in(mask, signal[None])[0]
        inner = eroded(mask, FIT_EDGE_PX)  # the edge has another sharpness, and another place if the pose is off
        used = inner if inner.sum() > INNER * mask.sum() else mask
        spare = np.array([panels > 0 and not is_wall(scene.lights[index].path) for index in groups.placed], bool)
        fit, counted = fit_light(basis, signal, used, full, spare=spare), used & ~full
        mean = basis.mean(0)
        squared = float(np.square(signal[counted], dtype=np.float64).sum())
        error = signal[counted] - np.tensordot(fit.strengths, basis[:, :, counted], (0, 1))
        given = fit.strengths * mean[:, mask].sum(1, dtype=np.float64)
        shares = given / max(float(given.sum()), 1e-12)
        answer = LightAnswer(
            lights=[
                _fitted_light(scene, groups.placed[n], fit, n, float(shares[n]))
                for n in np.argsort(-shares, kind="stable").tolist()
                if shares[n] > LEAST_SHARE
            ],
            explained=1 - float((error[0] * error[1]).sum()) / squared if squared else 0.0,
            squared=squared,
        )
        return answer, error

    def _basis(self, scene: Scene, number: int) -> NDArray[np.float32]:
        """Return (N, H, W) the light of each group on the detector. `number`: of the render, which has its own noise.

        It is not denoised: the products of two have no mean noise, and what a denoiser leaves has one.
        """
        own, unit = self._pictures.studio.settings, in_unit_light(scene)
        effort = replace(own.effort, denoiser="none")
        settings = replace(own, effort=effort, seed=own.seed + number)
        render = self._pictures.studio.maker.render(unit, settings, Stopwatch())
        return np.stack(
            [
                light_on_detector(scene, replace(render, groups=group[None] * np.array(gain, np.float32)), None)
                for group, gain in zip(render.groups, unit.gains, strict=True)
            ]
        )


def _fitted_light(scene: Scene, index: int, fit: LightFit, place: int, share: float) -> FittedLight:
    direction, distance = light_towards(scene.lights[index], centre_of(scene))
    return FittedLight(
        path=scene.lights[index].path,
        strength=float(fit.strengths[place]),
        low=float(fit.low[place]),
        high=float(fit.high[place]),
        share=share,
        direction=direction.tolist(),
        distance=distance,
    )


def _smoothed_in(mask: Mask, images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return images (N, H, W) smoothed over the mask's pixels alone: what is behind the target does not count."""
    planes = np.moveaxis(images, 0, -1)
    pieces = np.array_split(planes, max(ceil(planes.shape[-1] / CHUNK), 1), axis=-1)
    soft = [smoothed_in(mask, np.ascontiguousarray(piece), FIT_SMOOTHING_PX) for piece in pieces]
    return np.ascontiguousarray(np.moveaxis(np.concatenate(soft, -1), -1, 0))

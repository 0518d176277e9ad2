"""A picture's figures, computed from its runs by the formulas of `accuracy`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from statistics import fmean, median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.accuracy.error import RADIUS_PX, LinearError, Reference, linear_error, ssim, standard_error
from spin_usd.accuracy.measurement import Configuration, Figures, MeasuredPicture, Saving
from spin_usd.basics.arrays import Float
from spin_usd.commands.measure.renders import RenderStore
from spin_usd.errors import InputError
from spin_usd.renderers.background.sky import sky
from spin_usd.scene.derived.content_keys import RenderSettings, picture_seed
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.sensor.develop import develop, developed_without_noise
from spin_usd.sensor.exposure import exposed

HALF = 0.5  # of the largest coverage of a pixel
NOISE_PICTURES = 4  # with the detector's noise, each with its own seed


@dataclass(frozen=True, kw_only=True, eq=False)
class DevelopedReference:
    """The reference after the detector.

    scene: exposed as metered on the reference · sky: the background · image (H, W) or (H, W, 3): without noise or
        rounding, digital numbers · variance: of the image, over the target's pixels, by the reference's own error ·
        noise: root mean square of the detector's own noise and rounding there.
    """

    scene: Scene
    sky: NDArray[np.float32] | None
    image: Float
    variance: float
    noise: float


class PictureFigures:
    """One picture and the runs made of it. `reference`: keys of its reference's parts, two or more."""

    def __init__(self, scene: Scene, runs: RenderStore, reference: Sequence[str]) -> None:
        self.scene, self._runs, self._parts = scene, runs, reference
        self._region = scene.picture_region
        self._gains = in_unit_light(scene).gains

    def radiance(self, key: str) -> Radiance:
        """Return a run in the scene's own light."""
        return self._runs.render(key, self._region, groups=len(self._gains)).relit(self._gains)

    @cached_property
    def _whole(self) -> Reference:
        """The reference with its coverage, of all pixels of the region: (rows x columns, 4)."""
        return Reference.of(self.radiance(key).rgba.reshape(-1, 4) for key in self._parts)

    @cached_property
    def _target(self) -> NDArray[np.bool_]:
        """(rows, columns) of the region: pixels that the target covers by half or more, like pixels of labels; for a
        target smaller than a pixel, or smeared, by half or more of the largest coverage."""
        covered = self._whole.radiance[:, 3].reshape(self._region.shape)
        return np.asarray((covered > 0) & (covered >= HALF * covered.max(initial=0.0)))

    @cached_property
    def reference(self) -> Reference:
        """The reference's part that holds the target's pixels alone."""
        whole, target = self._whole, self._target.ravel()
        return Reference(
            radiance=whole.radiance[target, :3], variance=whole.variance[target, :3], parts=len(self._parts)
        )

    def linear_error(self, keys: Sequence[str]) -> LinearError:
        """Return the error in linear light of the runs with those keys, which differ in their seeds alone."""
        return linear_error(np.stack([self.radiance(key).rgb[self._target] for key in keys]), self.reference)

    def developed(self, seed: int) -> DevelopedReference:
        """Return the reference after the detector, its exposure as metered on the reference; `seed` of the dataset.
        Raises InputError if it shows nothing of the target."""
        if not self._target.any():
            found, do = "no ray of the reference meets the target", "measure pictures that show it larger"
            raise InputError(found, where=self.scene.frame.name, do=do)
        own_seed = picture_seed(self.scene, RenderSettings(renderer="blender", effort=Effort(), seed=seed))
        radiance, behind = self._mean(self._parts), sky(self.scene, seed=own_seed)
        sensor = replace(exposed(self.scene.sensor, radiance), auto_exposure=None)
        scene = replace(self.scene, sensor=sensor)
        image = developed_without_noise(scene, radiance, behind)
        noisy = (develop(scene, radiance, behind, seed=own_seed + number) for number in range(NOISE_PICTURES))
        squares = [self._square(picture - image) for picture in noisy]
        return DevelopedReference(
            scene=scene,
            sky=behind,
            image=image,
            variance=self._own_variance(scene, behind),
            noise=math.sqrt(fmean(squares)),
        )

    def _own_variance(self, scene: Scene, behind: NDArray[np.float32] | None) -> float:
        """Return the variance of the reference's image by its own error: from the difference between two halves of its
        parts."""
        halves = [self._parts[half::2] for half in range(2)]
        one, other = (developed_without_noise(scene, self._mean(half), behind) for half in halves)
        return self._square(one - other) / (len(self._parts) * sum(1 / len(half) for half in halves))

    def measured(self, image: DevelopedReference, *, samples: int, capped: bool) -> MeasuredPicture:
        """Return the picture and its reference, of so many `samples`, for a measurement."""
        region, frame = self._region, self.scene.frame
        return MeasuredPicture(
            name=frame.name,
            index=frame.index,
            region=(region.x0, region.y0, region.x1, region.y1),
            target_pixels=int(self._target.sum()),
            reference_samples=samples,
            reference_error=self.reference.error_squared**0.5,
            noise_dn=image.noise,
            reference_capped=capped,
        )

    def figures(
        self, image: DevelopedReference, setting: Configuration, keys: Sequence[str], *, capped: bool = False
    ) -> Figures:
        """Return the figures of the setting, from its runs; `capped`: the reference may be less exact than they are.
        Raises InputError if one of them is missing."""
        linear, pictures = self.linear_error(keys), [self._image_of(key, image) for key in keys]
        squares = [self._square(picture - image.image) for picture in pictures]
        off = max(fmean(squares) - image.variance, 0.0)
        own, own_dn = (self.reference.error_squared, image.variance) if capped else (0.0, 0.0)
        return Figures(
            frame=self.scene.frame.name,
            setting=setting,
            seeds=len(keys),
            **self.cost(keys),
            variance=linear.variance,
            bias_squared=linear.bias_squared,
            uncertainty=math.hypot(linear.uncertainty, own),
            brightness=linear.brightness,
            error_dn=math.sqrt(off),
            error_dn_uncertainty=math.sqrt(off + math.hypot(standard_error(squares), own_dn)) - math.sqrt(off),
            structure=fmean(self._unlikeness(picture, image) for picture in pictures),
        )

    def cost(self, keys: Sequence[str]) -> dict[str, Any]:
        """Return the fields of Figures on the runs' cost. Times are of runs that were not the first of their kind in a
        process, if possible."""
        costs = [self._runs.cost(key) for key in keys]
        timed = [cost for cost in costs if cost.warm] or costs
        return {
            "cpu_s": median(cost.cpu_s for cost in timed),
            "wall_s": median(cost.wall_s for cost in timed),
            "memory_bytes": max(cost.memory_bytes for cost in costs),
        }

    def saving(self, what: str, with_it: Sequence[str], without: Sequence[str]) -> Saving:
        """Return the savings by leaving that work out, from runs that differ in it alone, seed by seed, made in
        turns."""
        pairs = zip(with_it, without, strict=True)
        ratios = [self._runs.cost(one).cpu_s / self._runs.cost(other).cpu_s for one, other in pairs]
        return Saving(
            frame=self.scene.frame.name,
            what=what,
            cpu_s=self.cost(without)["cpu_s"],
            cpu_s_with=self.cost(with_it)["cpu_s"],
            ratio_least=min(ratios),
            ratio_most=max(ratios),
            difference=self.difference(with_it, without),
            noise=self.difference(without, [*without[1:], *without[:1]]),
        )

    def difference(self, ones: Sequence[str], others: Sequence[str]) -> float:
        """Relative root mean square difference between pairs of runs, one of each list."""
        pairs = zip(ones, others, strict=True)
        apart = [self.radiance(a).rgb.astype(np.float64) - self.radiance(b).rgb for a, b in pairs]
        return math.sqrt(fmean(self.reference.relative(each[self._target]) for each in apart))

    def _image_of(self, key: str, image: DevelopedReference) -> Float:
        return developed_without_noise(image.scene, self.radiance(key), image.sky)

    def _unlikeness(self, picture: Float, image: DevelopedReference) -> float:
        """Return 1 - SSIM, the mean over the target's pixels."""
        around = self._region.padded(2 * RADIUS_PX) & self.scene.camera.frame
        top = 2**image.scene.sensor.bit_depth - 1
        alike = ssim(picture[around.slices], image.image[around.slices], top=top)
        inside = (slice(self._region.y0 - around.y0, None), slice(self._region.x0 - around.x0, None))
        rows, columns = self._region.shape
        found = alike[inside][:rows, :columns][self._target]
        return max(1 - float(found.mean()), 0.0)

    def _square(self, deviation: Float) -> float:
        """Return the mean square of an image's deviation (H, W) or (H, W, C) over the target's pixels."""
        inside: Float = deviation[self._region.slices][self._target]
        return float((inside * inside).mean())

    def _mean(self, keys: Sequence[str]) -> Radiance:
        """Return the mean of runs, pixel by pixel."""
        total = sum(self.radiance(key).rgba.astype(np.float64) for key in keys)
        return Radiance.of(self._region, np.asarray(total / len(keys), np.float32))

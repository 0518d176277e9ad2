"""How far images are from others: renders from a reference in linear light, images in structure, labels in place."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import stdev
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.accuracy.measurement import LabelFigures
from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform

FLOOR = 0.4
"""eps, of the reference's mean over the target. Usual is eps^2 = 0.01 beside a white of 1 (Rousselle 2011); an exposure
that meters the target's mean at a quarter of white makes that 0.4 of the mean. With much less, shadows that no detector
can see would decide."""

SIGMA_PX = 1.5
RADIUS_PX = 5
K1, K2 = 0.01, 0.03


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """A reference: the mean of some parts, which are renders with other seeds."""

    radiance: Float
    """(P, 3) of the target's pixels."""
    variance: Float
    """(P, 3) of the radiance, estimated from the spread of its parts."""
    parts: int
    """How many parts it is the mean of."""

    @classmethod
    def of(cls, parts: Iterable[NDArray[Any]]) -> "Reference":
        """Return the mean of `parts`, (P, 3) each, which are independent and alike. Raises InputError for fewer than
        two."""
        mean: Any = 0.0
        squares: Any = 0.0
        count = 0
        for count, part in enumerate(parts, 1):  # one after another: there may be many, and they are large
            away = part.astype(np.float64) - mean
            mean = mean + away / count
            squares = squares + away * (part - mean)
        if count < 2:
            raise InputError(f"the reference has {count} parts", do="make at least 2: their spread gives its error")
        return cls(radiance=mean, variance=squares / (count * (count - 1)), parts=count)

    @cached_property
    def weight(self) -> Float:
        """(P,) factor that makes a squared deviation relative; 0 everywhere if all is dark."""
        floor = FLOOR * float(self.radiance.mean()) if self.radiance.size else 0.0
        power = _power(self.radiance) + floor * floor
        return np.divide(1, power, out=np.zeros_like(power), where=power > 0)

    @cached_property
    def error_squared(self) -> float:
        """The reference's own mean square error, relative."""
        return _mean(self.weight * self.variance.mean(-1))

    def relative(self, deviation: Float) -> float:
        """Mean square of a deviation (..., P, 3), relative."""
        return _mean(self.weight * _power(deviation))


@dataclass(frozen=True, kw_only=True)
class LinearError:
    """The error of renders in linear light, separated into variance and bias.

    A pixel has the renders x_s of S seeds, their mean x, and a reference r of variance v:

    variance  sum |x_s - x|^2 / (S - 1)
    bias^2    |x - r|^2 - variance / S - v, so that neither the renders' noise nor the reference's counts as bias
    relative  each over |r|^2 + eps^2, then the mean over the target's pixels; |.|^2 is the mean over R, G and B

    All three are unbiased, so bias^2 is a little below zero without bias.
    """

    variance: float
    """Relative."""
    bias_squared: float
    """Relative; with the variance it makes the mean square."""
    uncertainty: float
    """The standard error of the mean square.

    Of each seed |x_s - r|^2 - v estimates that too: its expectation is variance + bias^2. Their spread over the seeds
    gives the standard error. It does not include the reference's own error, which limits it unless far smaller than the
    compared error.
    """
    brightness: float
    """The target's light over the reference's, minus 1."""

    @property
    def squared(self) -> float:
        """The mean square error, relative; a bias below zero counts as zero."""
        return self.variance + max(self.bias_squared, 0.0)


def linear_error(renders: NDArray[Any], reference: Reference) -> LinearError:
    """Return the error of `renders` (S, P, 3) with different seeds. Raises InputError for fewer than two."""
    if len(renders) < 2:
        raise InputError(f"{len(renders)} renders are given", do="make at least 2: their spread gives their variance")
    exact = renders.astype(np.float64)
    mean = exact.mean(0)
    variance = reference.relative(exact - mean) * len(exact) / (len(exact) - 1)
    apart = reference.relative(mean - reference.radiance)
    squares = [reference.relative(render - reference.radiance) for render in exact]
    light = float(reference.radiance.sum())
    return LinearError(
        variance=variance,
        bias_squared=apart - variance / len(exact) - reference.error_squared,
        uncertainty=standard_error(squares),
        brightness=float(mean.sum()) / light - 1 if light else 0.0,
    )


def standard_error(values: Sequence[float]) -> float:
    """Return the standard error of the mean of two values or more, which are independent and identically
    distributed."""
    return stdev(values) / math.sqrt(len(values))


def _power(vectors: Float) -> Float:
    """Mean over red, green and blue of their squares."""
    return np.asarray((vectors * vectors).mean(-1))


def _mean(values: Float) -> float:
    return float(values.mean()) if values.size else 0.0


def ssim(a: Float, b: Float, *, top: float) -> Float:
    """Return the structural similarity (H, W) of the images `a` and `b`, (H, W) or (H, W, C) with channels that are
    averaged, which reach from 0 to `top`: 1 where the windows around a pixel are equal, less where not.

    Beyond its edge an image is mirrored. A window is a Gaussian of 11 x 11 pixels, whose standard deviation is 1.5.
    Source: Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image quality assessment: from error visibility to
    structural similarity", IEEE Transactions on Image Processing 13 (4), 2004, section III-C.
    """
    c1, c2 = (K1 * top) ** 2, (K2 * top) ** 2
    mean_a, mean_b = _windowed(a), _windowed(b)
    both = mean_a * mean_b
    squares = mean_a * mean_a + mean_b * mean_b
    covariance = _windowed(a * b) - both
    variances = _windowed(a * a + b * b) - squares
    found = (2 * both + c1) * (2 * covariance + c2) / ((squares + c1) * (variances + c2))
    return found.mean(-1) if found.ndim == 3 else found


def _windowed(image: Float) -> Float:
    """Return the weighted mean around each pixel."""
    from scipy import ndimage  # not above: scipy is slow to load, and few need it

    return np.asarray(ndimage.gaussian_filter(image, SIGMA_PX, radius=RADIUS_PX, axes=(0, 1)), np.float64)


@dataclass(frozen=True, kw_only=True, eq=False)
class LabelImages:
    """The labels of a whole picture, 0 = nothing."""

    depth: NDArray[Any]
    """(H, W), metres."""
    part: NDArray[Any]
    """(H, W), ids."""
    body: NDArray[Any]
    """(H, W, 3), metres."""

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(H, W), where the target is."""
        return np.asarray(self.part > 0)


@dataclass(frozen=True, kw_only=True)
class Viewpoint:
    """The camera and pose of a picture, which decide where a body point appears."""

    camera: Camera
    T_cam_body: Transform


def agreement(
    ours: LabelImages, theirs: LabelImages, sight: Viewpoint, *, frame: str, renderer: str, against: str
) -> LabelFigures:
    """Return the agreement of the labels `ours`, from the pass of `renderer`, with `theirs`, from `against`; two empty
    silhouettes agree."""
    union, both = ours.seen | theirs.seen, ours.seen & theirs.seen
    apart = np.abs(ours.depth[both].astype(np.float64) - theirs.depth[both])
    return LabelFigures(
        frame=frame,
        renderer=renderer,
        against=against,
        iou=float(both.sum() / union.sum()) if union.any() else 1.0,
        depth_m=float(apart.max(initial=0.0)),
        reprojection_px=_worst_reprojection(ours, sight),
        part_pixels=int((ours.part[both] != theirs.part[both]).sum()),
    )


def _worst_reprojection(labels: LabelImages, sight: Viewpoint) -> float:
    """Return the largest distance, pixels, of the projection of a pixel's body point from that pixel's centre."""
    rows, columns = np.nonzero(labels.seen)
    body = labels.body[rows, columns].astype(np.float64)
    found: Float = sight.camera.project(sight.T_cam_body.points(body))
    off = found - (np.stack([columns, rows], -1) + 0.5)
    return float(np.hypot(*off.T).max(initial=0.0))

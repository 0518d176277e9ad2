"""How far a reconstructed surface is from the true one.

Accuracy is the mean distance of the reconstruction's points from the true surface, completeness the mean distance of
the true points from the reconstruction, not squared; Chamfer's distance is the mean of the two. Sources: Knapitsch et
al. 2017, "Tanks and Temples" (F-score); Mescheder et al. 2019, "Occupancy Networks" (normal consistency).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.scoring.shape_surface import ScoredSurface


@dataclass(frozen=True, kw_only=True, eq=False)
class ShapeErrors:
    """Distances between a reconstruction, of P points, and the truth, of T points; metres."""

    accuracy: Float
    """(P,) from each point of the reconstruction to the true surface."""
    completeness: Float
    """(T,) from each true point to the reconstruction."""
    agreement: float | None
    """Mean over both directions of the normals' cosine without its sign; None without normals."""

    @property
    def chamfer(self) -> float:
        """Mean of the mean distances in both directions, metres."""
        return float(self.accuracy.mean() + self.completeness.mean()) / 2

    def f_score(self, threshold: float) -> float:
        """Return the harmonic mean of precision and recall at the `threshold`, metres."""
        precision, recall = (share_within(each, threshold) for each in (self.accuracy, self.completeness))
        return 2 * precision * recall / (precision + recall) if precision + recall else 0.0


def share_within(distances: Float, threshold: float) -> float:
    """Return the share of the distances that are at most the threshold."""
    return float(np.mean(distances <= threshold))


def shape_errors(found: ScoredSurface, truth: ScoredSurface, true_points: Float, true_normals: Float) -> ShapeErrors:
    """Return the errors of the surface `found`. Accuracy is to the whole of `truth`; completeness is of `true_points`
    (T, 3), such as those that can be seen, with their normals (T, 3)."""
    accuracy, at_truth = truth.nearest(found.points)
    completeness, at_found = found.nearest(true_points)
    agreement = None
    if found.normals is not None and at_truth is not None and at_found is not None:
        agreement = (_cosine(found.normals, at_truth) + _cosine(true_normals, at_found)) / 2
    return ShapeErrors(accuracy=accuracy, completeness=completeness, agreement=agreement)


def _cosine(one: Float, other: Float) -> float:
    return float(np.abs((one * other).sum(-1)).mean())


def picture_errors(found: NDArray[np.uint8], true: NDArray[np.uint8], mask: NDArray[np.bool_]) -> tuple[float, float]:
    """Return PSNR in decibels and SSIM within the mask (H, W) of a picture (H, W, C).

    PSNR is of the pixels in the mask; infinite for equal ones. SSIM is the mean over the mask and the channels of the
    map of pictures that are black outside of it. Source: Wang et al. 2004, whose window and constants it has.
    """
    one, other = (np.where(mask[..., None], each, 0) / 255 for each in (found, true))
    error = float(((one - other)[mask] ** 2).mean())
    return -10 * float(np.log10(error)) if error else np.inf, float(similarity(one, other)[mask].mean())


def similarity(one: Float, other: Float) -> Float:
    """Return the map (H, W, C) of structural similarity of two pictures (H, W, C) from 0 to 1."""
    from scipy.ndimage import gaussian_filter  # not above: it takes long to load

    def smooth(values: Float) -> Float:
        return np.asarray(gaussian_filter(values, (1.5, 1.5, 0), radius=(5, 5, 0)))  # 11 x 11 pixels

    a, b, steady = smooth(one), smooth(other), (0.01**2, 0.03**2)
    spread = smooth(one * one) - a * a + smooth(other * other) - b * b
    common = smooth(one * other) - a * b
    return (2 * a * b + steady[0]) * (2 * common + steady[1]) / ((a * a + b * b + steady[0]) * (spread + steady[1]))

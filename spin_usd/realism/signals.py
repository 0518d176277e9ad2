"""The light of a picture's target: its distribution, its structure, and its likeness to another picture's."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.realism.picture_view import SATURATED, Mask, PictureView

LEAST_PIXELS = 64
LEAST_SIDE = 16  # pixels of a target whose spectrum is taken
SPECTRUM = (2.0, 0.25)  # cycles per crop, and per pixel, between which the slope is fitted


def signal_median(view: PictureView) -> float:
    """Return the median of the target's smooth signal."""
    return _quantile(view, 0.5)


def signal_p90(view: PictureView) -> float:
    """Return the 90th percentile of the target's smooth signal."""
    return _quantile(view, 0.9)


def dark_share(view: PictureView, limit: float | None = None) -> float:
    """Return the share of the target's pixels whose smooth signal is as dark as the room."""
    found = view.target_signal
    return float((found <= (limit or view.dark_limit)).mean()) if len(found) else float("nan")


def saturated_share(view: PictureView) -> float:
    """Return the share of the target's pixels that are full."""
    return float((view.grey[view.target] >= SATURATED).mean()) if view.target.any() else float("nan")


def lit_background(view: PictureView) -> float:
    """Return the share of the pixels around the target that are brighter than the room."""
    around = ~view.target
    return float((view.smooth[around] > view.dark_limit).mean()) if around.any() else float("nan")


def spectrum_slope(view: PictureView) -> float:
    """Return the slope of the radial power spectrum of the target's crop in double logarithms; NaN if it is small."""
    rows, columns = np.nonzero(view.target)
    if not len(rows) or min(np.ptp(rows), np.ptp(columns)) < LEAST_SIDE:
        return float("nan")
    crop = np.where(view.target, np.clip(view.signal, 0, None), 0)[
        rows.min() : rows.max() + 1, columns.min() : columns.max() + 1
    ]
    window = np.outer(np.hanning(crop.shape[0]), np.hanning(crop.shape[1]))
    power = np.abs(np.fft.rfft2((crop - crop.mean()) * window)) ** 2
    f = np.hypot(np.fft.fftfreq(crop.shape[0])[:, None], np.fft.rfftfreq(crop.shape[1])[None])
    low, high = SPECTRUM[0] / min(crop.shape), SPECTRUM[1]
    edges = np.geomspace(low, high, 13)
    place = np.digitize(f, edges)
    means = np.array([power[place == i].mean() if (place == i).any() else np.nan for i in range(1, len(edges))])
    good = np.isfinite(means) & (means > 0)
    if good.sum() < 4 or low >= high:
        return float("nan")
    return float(np.polyfit(np.log(np.sqrt(edges[1:] * edges[:-1]))[good], np.log(means[good]), 1)[0])


def correlation(one: NDArray[np.float32], other: NDArray[np.float32], mask: Mask) -> float:
    """Return Pearson's correlation of two signals (H, W) over the mask; NaN for few pixels, 0 if one is constant."""
    a, b = one[mask].astype(np.float64), other[mask].astype(np.float64)
    if len(a) < LEAST_PIXELS:
        return float("nan")
    a, b = a - a.mean(), b - b.mean()
    norm = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / norm if norm > 1e-9 * len(a) else 0.0


def wasserstein(one: PictureView, other: PictureView, mask: Mask) -> float:
    """Return the first Wasserstein distance of the smooth signals over the mask (H, W), steps of 8 bits; NaN for few
    pixels. With equal numbers of pixels it is the mean difference of the sorted signals."""
    a, b = (np.sort(view.smooth[mask].astype(np.float64)) for view in (one, other))
    return float(np.abs(a - b).mean()) if len(a) >= LEAST_PIXELS else float("nan")


def _quantile(view: PictureView, share: float) -> float:
    found: Float = view.target_signal
    return float(np.quantile(found, share)) if len(found) else float("nan")

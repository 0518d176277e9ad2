"""A two-sample test: can a small classifier tell patches of real pictures from patches of ours?

The classifier is a logistic regression on statistics of patches; it is trained on some pictures and tried on others,
and both pictures of a pair are on the same side. The area under its ROC curve is 0.5 where it cannot. Source: D.
Lopez-Paz, M. Oquab, "Revisiting classifier two-sample tests" (2017).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.realism.picture_view import FULL, PictureView

PATCH = 24  # pixels a side
MOST_PATCHES = 48  # of a picture
COVERED = 0.75  # of a patch by the target
FOLDS = 5
RIDGE = 1.0  # of the regression, in patches
STEPS = 25
LEAST_PICTURES = 4


def patch_features(view: PictureView) -> Float:
    """Return (N, K) statistics of patches of the target, from places that depend on its mask alone."""
    rows, columns = (length // PATCH for length in view.grey.shape)
    cut = (slice(rows * PATCH), slice(columns * PATCH))
    covered = _patches(view.target[cut].astype(np.float32)).mean((1, 2)) >= COVERED
    chosen = np.flatnonzero(covered)
    chosen = chosen[:: max(-(-len(chosen) // MOST_PATCHES), 1)]
    patches = _patches(view.grey[cut] / np.float32(FULL))[chosen]
    if not len(patches):
        return np.zeros((0, 0))
    flat = patches.reshape(len(patches), -1)
    across, down = np.diff(patches, axis=2), np.diff(patches, axis=1)
    spectrum = np.abs(np.fft.rfft2(patches - patches.mean((1, 2), keepdims=True))) ** 2
    f = np.hypot(np.fft.fftfreq(PATCH)[:, None], np.fft.rfftfreq(PATCH)[None])
    ring = np.digitize(f, np.linspace(0.02, 0.6, 7))
    power = np.stack([spectrum[:, ring == i].mean(1) for i in range(1, 7)], -1)
    return np.column_stack(
        [
            np.quantile(flat, (0.02, 0.25, 0.5, 0.75, 0.98), axis=1).T,
            np.log(flat.std(1) + 1e-4),
            *(np.log(np.abs(d).mean((1, 2)) + 1e-4) for d in (across, down)),
            *(np.quantile(np.abs(d).reshape(len(d), -1), 0.98, axis=1) for d in (across, down)),
            (flat > 0.98).mean(1),
            np.log(power + 1e-8),
        ]
    )


def separability(real: Sequence[Float], ours: Sequence[Float]) -> tuple[float, Float]:
    """Return the area under the ROC curve over all patches, and the area for each pair of pictures, NaN without
    patches. `real`, `ours`: the features of each picture, in pairs. NaN for fewer than LEAST_PICTURES pairs."""
    pairs = [place for place, (a, b) in enumerate(zip(real, ours, strict=True)) if len(a) and len(b)]
    areas = np.full(len(real), np.nan)
    if len(pairs) < LEAST_PICTURES:
        return float("nan"), areas
    x = np.concatenate([each[place] for place in pairs for each in (real, ours)])
    y = np.concatenate([np.repeat((0.0, 1.0), (len(real[place]), len(ours[place]))) for place in pairs])
    of = np.concatenate([np.full(len(real[p]) + len(ours[p]), p) for p in pairs])
    scores = np.empty(len(x))
    for fold in range(FOLDS):
        held = np.isin(of, pairs[fold::FOLDS])
        if held.any():
            scores[held] = _scores(x[~held], y[~held], x[held])
    for place in pairs:
        areas[place] = area(scores[of == place], y[of == place])
    return area(scores, y), areas


def area(scores: Float, positive: Float) -> float:
    """Return the area under the ROC curve: the share of pairs in the right order, ties half."""
    from scipy.stats import rankdata

    ranks, count = rankdata(scores), float(positive.sum())
    others = len(positive) - count
    return float((ranks[positive > 0].sum() - count * (count + 1) / 2) / (count * others))


def _scores(x: Float, y: Float, held: Float) -> Float:
    """Return the log odds of `held`, by a logistic regression on x (N, K), y (N,) by Newton's method."""
    mean, spread = x.mean(0), x.std(0) + 1e-9
    design = np.column_stack([np.ones(len(x)), (x - mean) / spread])
    weights, ridge = np.zeros(design.shape[1]), RIDGE * np.eye(design.shape[1])
    for _ in range(STEPS):
        p = 1 / (1 + np.exp(-np.clip(design @ weights, -30, 30)))
        slope = design.T @ (y - p) - ridge @ weights
        weights += np.linalg.solve((design * (p * (1 - p))[:, None]).T @ design + ridge, slope)
    found: Float = np.column_stack([np.ones(len(held)), (held - mean) / spread]) @ weights
    return found


def _patches(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    rows, columns = (length // PATCH for length in picture.shape)
    return picture.reshape(rows, PATCH, columns, PATCH).swapaxes(1, 2).reshape(-1, PATCH, PATCH)

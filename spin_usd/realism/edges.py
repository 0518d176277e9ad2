"""Edges of a picture: how sharp its sharpest are, and how far its silhouette is from the labels' silhouette.

An edge's profile is the integral of a Gaussian, which stands for lens, detector and pixel together (slanted edges of
ISO 12233, one at a time). Rounded edges of a body are wider: so the sharpest count.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.realism.picture_view import SATURATED, Mask

REACH = 6.0  # pixels of a profile to either side
STEP = 0.5
SIGMAS = np.geomspace(0.25, 4.0, 96)
SHIFTS = np.arange(-1.0, 1.01, 0.25)
ALONG = (-2, -1, 0, 1, 2)  # pixels along an edge, over which its profile is averaged
LEAST_HEIGHT = 6.0  # times the noise: of an edge
LEAST_GREY = 12.0  # and in a picture without noise
FIT = 0.99  # correlation with the profile
SHARPEST = 0.2  # quantile
MOST_EDGES = 4000
LEAST_EDGES = 12
SILHOUETTE_REACH = 12.0  # pixels that a silhouette is searched for
CLEAR = 6.0  # times the noise: of a silhouette's step


def edge_spread(grey: NDArray[np.float32], within: Mask, noise: float) -> float:
    """Return the standard deviation (pixels) of the sharpest edges within the mask (H, W): the SHARPEST quantile. NaN
    where there are too few clear edges."""
    import cv2

    soft = cv2.GaussianBlur(grey, (0, 0), 1.0)
    gx, gy = cv2.Sobel(soft, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(soft, cv2.CV_32F, 0, 1, scale=1 / 8)
    slope = np.hypot(gx, gy)
    least = max(LEAST_HEIGHT * noise, LEAST_GREY)
    peaks = within & (slope > least / 10) & (slope >= cv2.dilate(slope, np.ones((3, 3), np.uint8)) - 1e-6)
    rows, columns = np.nonzero(peaks)
    if len(rows) < LEAST_EDGES:
        return float("nan")
    chosen = np.argsort(-slope[rows, columns], kind="stable")[:MOST_EDGES]
    at = np.stack([columns[chosen], rows[chosen]], -1).astype(np.float64)
    normal = np.stack([gx, gy], -1)[rows[chosen], columns[chosen]] / slope[rows[chosen], columns[chosen], None]
    along = normal[:, ::-1] * (-1, 1)
    profiles = np.mean([sampled(grey, at + along * k, normal, _offsets(REACH)) for k in ALONG], axis=0)
    height = profiles[:, -5:].mean(1) - profiles[:, :5].mean(1)
    profiles = profiles[(height > least) & (profiles.max(1) < SATURATED)]  # a cut-off edge is too sharp
    if len(profiles) < LEAST_EDGES:
        return float("nan")
    templates, sigmas = _templates()
    centred = profiles - profiles.mean(1, keepdims=True)
    centred /= np.linalg.norm(centred, axis=1, keepdims=True)
    fit = centred @ templates.T
    best = fit.argmax(1)
    good = fit[np.arange(len(fit)), best] > FIT
    return float(np.quantile(sigmas[best[good]], SHARPEST)) if good.sum() >= LEAST_EDGES else float("nan")


@dataclass(frozen=True, kw_only=True)
class SilhouetteOffsets:
    """Distances of a picture's silhouette edges from the labels', along the outward normal, pixels."""

    median: float
    spread: float
    """Median absolute deviation from the median."""
    edges: int
    """Number of edges found."""
    searched: int


def silhouette_offsets(grey: NDArray[np.float32], target: Mask, noise: float) -> SilhouetteOffsets:
    """Find the picture's edges near the edge of the target's mask (H, W); NaN where there are too few."""
    import cv2

    inside = cv2.GaussianBlur(target.astype(np.float32), (0, 0), 2.0)
    gx, gy = cv2.Sobel(inside, cv2.CV_32F, 1, 0), cv2.Sobel(inside, cv2.CV_32F, 0, 1)
    border = target & (cv2.erode(target.astype(np.uint8), np.ones((3, 3), np.uint8)) == 0)
    border[[0, -1]] = border[:, [0, -1]] = False  # the frame's edge is not the target's
    rows, columns = np.nonzero(border)
    steps = max(len(rows) // 1500, 1)
    rows, columns = rows[::steps], columns[::steps]
    outward = -np.stack([gx, gy], -1)[rows, columns].astype(np.float64)
    outward = outward / np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    offsets = _offsets(SILHOUETTE_REACH)
    at = np.stack([columns, rows], -1).astype(np.float64) + outward * 0.5  # the edge is between two pixels
    soft = np.asarray(cv2.GaussianBlur(grey, (0, 0), 1.0), np.float32)
    profiles = sampled(soft, at, outward, offsets)
    slopes = np.abs(profiles[:, 2:] - profiles[:, :-2])
    best = slopes.argmax(1) if len(slopes) else np.zeros(0, int)
    clear = slopes.max(1) > max(CLEAR * noise * 0.3, 3.0) if len(slopes) else np.zeros(0, bool)
    found = offsets[1:-1][best[clear]]
    if len(found) < LEAST_EDGES:
        return SilhouetteOffsets(median=np.nan, spread=np.nan, edges=len(found), searched=len(rows))
    median = float(np.median(found))
    spread = float(np.median(np.abs(found - median)))
    return SilhouetteOffsets(median=median, spread=spread, edges=len(found), searched=len(rows))


def sampled(grey: NDArray[np.float32], at: Float, along: Float, offsets: Float) -> Float:
    """Return (N, len(offsets)): the picture on lines through the pixel centres `at` (N, 2) along unit vectors."""
    import cv2

    places = (at[:, None] + along[:, None] * offsets[:, None]).astype(np.float32)
    pieces = [  # OpenCV's maps end at 32767 rows
        cv2.remap(grey, piece[..., 0], piece[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        for piece in np.array_split(places, max(len(places) // 16384 + 1, 1))
        if len(piece)
    ]
    return np.concatenate([np.asarray(piece, np.float64) for piece in pieces] or [np.zeros((0, len(offsets)))])


def _offsets(reach: float) -> Float:
    return np.arange(-reach, reach + STEP / 2, STEP, dtype=np.float64)


@lru_cache(maxsize=1)
def _templates() -> tuple[Float, Float]:
    """Return unit profiles (M, K) of mean 0 by width and shift, and the width of each."""
    from scipy.special import erf

    x = _offsets(REACH)
    found = [erf((x - shift) / (sigma * 2**0.5)) for sigma in SIGMAS for shift in SHIFTS]
    profiles = np.array(found) - np.mean(found, axis=1, keepdims=True)
    profiles /= np.linalg.norm(profiles, axis=1, keepdims=True)
    return profiles, np.repeat(SIGMAS, len(SHIFTS))

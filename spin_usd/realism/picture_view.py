"""A picture, real or rendered, as the measures of the gap see it.

Grey is in steps of 8 bits, 0 to 255, whatever the depth of the file. Signal is grey above the black level.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.realism.darkness import Darkness, darkness

FULL = 255.0
SATURATED = 250.0  # grey: JPEG leaves full pixels a few steps below the end
SMOOTHING_PX = 2.0  # standard deviation: structure that small surface detail and noise do not decide
SMOOTHED_NOISE = 1 / (2 * SMOOTHING_PX * np.pi**0.5)  # of white noise of unit standard deviation
DARK_SIGMAS = 3.0
LEAST_DARK = 1.0  # grey: what counts as dark in a picture without noise
LEAST_WEIGHT = 1e-3  # of a Gaussian: the share in a mask that counts
EDGE_PX = 3  # between a part's pixels that are measured and the part's edge

Mask = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class PictureView:
    """A picture and the place of the target's parts in it."""

    grey: NDArray[np.float32]
    """(H, W) steps of 8 bits."""
    parts: NDArray[np.integer]
    """(H, W) part ids of the stage's labels; 0 for none."""

    @cached_property
    def darkness(self) -> Darkness:
        """Black level and noise."""
        return darkness(self.grey)

    @cached_property
    def target(self) -> Mask:
        """(H, W) the target's pixels."""
        return np.asarray(self.parts > 0)

    @cached_property
    def signal(self) -> NDArray[np.float32]:
        """(H, W) grey above the black level."""
        return np.asarray(self.grey - np.float32(self.darkness.level))

    @cached_property
    def smooth(self) -> NDArray[np.float32]:
        """(H, W) signal after a Gaussian of SMOOTHING_PX, of the target's pixels over the target and of the others over
        its surroundings: so a lit background adds nothing to the target."""
        sides = [smoothed_in(side, self.signal) for side in (self.target, ~self.target)]
        return np.where(self.target, *sides)

    @cached_property
    def target_signal(self) -> Float:
        """(N,) smooth signal of the target's pixels."""
        return self.smooth[self.target].astype(np.float64)

    @property
    def dark_limit(self) -> float:
        """Signal below which a smooth pixel is as dark as the room."""
        return float(max(DARK_SIGMAS * SMOOTHED_NOISE * self.darkness.noise, LEAST_DARK))

    @cached_property
    def edge_places(self) -> Mask:
        """(H, W) the target, and its surroundings where they are dark: edges before a lit background may be of a
        picture that was put together, which has no lens."""
        lit = ~self.target & (self.smooth > self.dark_limit + LEAST_DARK) & ~dilated(self.target, EDGE_PX)
        return dilated(self.target, EDGE_PX) & ~dilated(lit, 3 * EDGE_PX)

    def part(self, number: int) -> Mask:
        """Return the pixels (H, W) of a part that are EDGE_PX away from its edge."""
        return eroded(np.asarray(self.parts == number), EDGE_PX)


def smoothed(signal: NDArray[np.float32], sigma: float = SMOOTHING_PX) -> NDArray[np.float32]:
    """Return (H, W) or (H, W, C) after a Gaussian of `sigma` pixels; mirrored at the rim."""
    import cv2  # not above: it is slow to load

    return np.asarray(cv2.GaussianBlur(signal, (0, 0), sigma, borderType=cv2.BORDER_REFLECT), np.float32)


def smoothed_in(mask: Mask, signal: NDArray[np.float32], sigma: float = SMOOTHING_PX) -> NDArray[np.float32]:
    """Return (H, W) or (H, W, C) after a Gaussian of `sigma` pixels over the mask's pixels (H, W) alone."""
    weight = mask.astype(np.float32)
    of_all = np.maximum(smoothed(weight, sigma), LEAST_WEIGHT)
    both = (weight, of_all) if signal.ndim == 2 else (weight[..., None], of_all[..., None])
    return np.asarray(smoothed(signal * both[0], sigma).reshape(signal.shape) / both[1])


def dilated(mask: Mask, pixels: int) -> Mask:
    """Return the pixels (H, W) that are up to `pixels` away from one of the mask."""
    return ~eroded(~mask, pixels)


def eroded(mask: Mask, pixels: int) -> Mask:
    """Return the pixels (H, W) of the mask whose neighbours up to `pixels` away are in it, or beyond the frame."""
    import cv2

    kernel = np.ones((2 * pixels + 1, 2 * pixels + 1), np.uint8)
    return np.asarray(cv2.erode(mask.astype(np.uint8), kernel) > 0)

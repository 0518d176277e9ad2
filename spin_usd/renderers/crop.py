"""The boxes of pixels to render: those that bodies can touch, and few enough that starting them costs little."""

from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.bands import tight_bands
from spin_usd.geometry.blur import magnification
from spin_usd.geometry.region import Region
from spin_usd.scene.scene import OneBody, Scene

# What starting a render costs, in samples of empty pixels: some 15 ms against half a microsecond.
BAND_COST_SAMPLES = 30_000
STOP_PX = 4.0  # by so much may bands be too wide, rather than take longer to find


def label_bands(scene: OneBody) -> list[Region]:
    """Boxes that hold every pixel centre of `scene.region` that sees the body."""
    mesh = scene.target.mesh
    points, edges = mesh.outline
    return tight_bands(
        scene.camera, scene.T_cam_body.points(points), edges, scene.region, band_cost_px=BAND_COST_SAMPLES
    )


def picture_bands(scene: Scene, *, samples: int) -> list[Region]:
    """Boxes that hold every pixel of `scene.picture_region` that a body, blurred or not, can touch."""
    region = scene.picture_region
    found = [_blurred_outline(one) for one in scene.one_body_scenes if not one.picture_region.empty]
    outlines = [outline for outline in found if outline is not None]
    if len(outlines) < len(found):
        return [region]
    first = accumulate((len(outline.points) for outline in outlines), initial=0)
    return tight_bands(
        scene.camera,
        np.concatenate([np.zeros((0, 3)), *(outline.points for outline in outlines)]),
        np.concatenate([outline.edges + start for outline, start in zip(outlines, first, strict=False)]),
        region,
        band_cost_px=BAND_COST_SAMPLES / samples,
        blur_px=max(outline.blur_px for outline in outlines),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class BlurredOutline:
    """Points (P, 3), camera frame, metres, and edges (E, 2) between them, each blurred by `blur_px`: a body lies within
    their outline while the shutter is open."""

    points: Float
    edges: NDArray[np.integer]
    blur_px: float


def _blurred_outline(scene: OneBody) -> BlurredOutline | None:
    """Return the outline of the scene's body; None where there is none, for it comes too near to the camera."""
    spots, lines = scene.target.mesh.outline
    places = np.stack([pose.points(spots) for pose in scene.poses])
    blur_radius = scene.blur_radius(places.reshape(-1, 3))
    if (places[..., 2] <= 0).any() or not np.isfinite(blur_radius).all():
        return None
    xy = places[..., :2] / places[..., 2:]
    chosen, blur_px = _stops(scene.camera.pixels(xy))
    blur_px += magnification(scene.camera) * float(blur_radius.max())
    points = places[chosen].reshape(-1, 3)
    edges = np.concatenate([lines + stop * len(spots) for stop in range(len(places[chosen]))])
    return BlurredOutline(points=points, edges=edges, blur_px=blur_px)


def _stops(uv: Float) -> tuple[slice, float]:
    """Few of the places `uv` (poses, P, 2), pixels, each in the middle of the stretch of poses that it stands for, and
    how far, pixels, a point is at most from its place there."""
    stretch = steps = len(uv) - 1
    while steps:
        middles = uv[stretch // 2 :: stretch]
        rests = (uv[start : start + steps - stretch + 1 : stretch] for start in range(stretch + 1))
        way = max(float(np.abs(rest - middles).max()) for rest in rests)
        if way <= STOP_PX or stretch == 2:
            return slice(stretch // 2, None, stretch), way
        stretch //= 2
    return slice(None), 0.0

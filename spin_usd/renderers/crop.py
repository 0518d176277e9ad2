"""The boxes of pixels to render: those that the target can touch, and few enough that starting them costs little."""

import numpy as np

from spin_usd.arrays import Float
from spin_usd.geometry.bands import tight_bands
from spin_usd.geometry.blur import magnification
from spin_usd.geometry.region import Region
from spin_usd.scene.model import Scene

# What starting a render costs, in samples of empty pixels: some 15 ms against half a microsecond.
BAND_COST_SAMPLES = 30_000
STOP_PX = 4.0  # by so much may bands be too wide, rather than take longer to find


def label_bands(scene: Scene) -> list[Region]:
    """Boxes that hold every pixel centre of `scene.region` that sees the target."""
    mesh = scene.target.mesh
    points, edges = mesh.outline
    return tight_bands(
        scene.camera, scene.T_cam_body.points(points), edges, scene.region, band_cost_px=BAND_COST_SAMPLES
    )


def picture_bands(scene: Scene, *, samples: int) -> list[Region]:
    """Boxes that hold every pixel of `scene.picture_region` that the target, blurred or not, can touch."""
    (spots, lines), region, cost = scene.target.mesh.outline, scene.picture_region, BAND_COST_SAMPLES / samples
    places = np.stack([pose.points(spots) for pose in scene.poses])
    blur_radius = scene.blur_radius(places.reshape(-1, 3))
    if (places[..., 2] <= 0).any() or not np.isfinite(blur_radius).all():
        return [region]
    xy = places[..., :2] / places[..., 2:]
    chosen, blur_px = _stops(scene.camera.pixels(xy))
    blur_px += magnification(scene.camera) * float(blur_radius.max())
    points = places[chosen].reshape(-1, 3)
    edges = np.concatenate([lines + stop * len(spots) for stop in range(len(places[chosen]))])
    return tight_bands(scene.camera, points, edges, region, band_cost_px=cost, blur_px=blur_px)


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

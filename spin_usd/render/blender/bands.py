"""Which boxes of pixels to render: those that the target can touch, and few enough that starting them costs little."""

import numpy as np

from spin_usd.arrays import Float
from spin_usd.geometry.bands import tight_bands
from spin_usd.geometry.blur import reach_px
from spin_usd.geometry.region import Region
from spin_usd.scene.model import Scene

# What starting a render costs, in samples of empty pixels: some 15 ms against half a microsecond.
BAND_COST_SAMPLES = 30_000


def label_bands(scene: Scene) -> list[Region]:
    """Boxes that hold every pixel centre of `scene.region` that sees the target."""
    mesh = scene.target.mesh
    points = scene.T_cam_body.points(mesh.points)
    return tight_bands(scene.camera, points, mesh.edges, scene.region, band_cost_px=BAND_COST_SAMPLES)


def picture_bands(scene: Scene, *, samples: int) -> list[Region]:
    """Boxes that hold every pixel of `scene.picture_region` that the target, smeared or not, can touch."""
    mesh, region, cost = scene.target.mesh, scene.picture_region, BAND_COST_SAMPLES / samples
    places = np.stack([pose.points(mesh.points) for pose in scene.poses])
    if (places[..., 2] <= 0).any():
        return [region]
    smear = _smear_px(scene, places) if scene.thin_lens or scene.shutter else 0.0
    if not np.isfinite(smear):
        return [region]
    edges = np.concatenate([mesh.edges + pose * len(mesh.points) for pose in range(len(places))])
    return tight_bands(scene.camera, places.reshape(-1, 3), edges, region, band_cost_px=cost, reach_px=smear)


def _smear_px(scene: Scene, places: Float) -> float:
    """How far, pixels, anything of the target can be seen from where one of its `places` (poses, P, 3) puts it."""
    xy = places[..., :2] / places[..., 2:]
    reach = scene.reach(places.reshape(-1, 3))
    if not np.isfinite(reach).all():
        return np.inf
    half_steps = np.abs(np.diff(scene.camera.pixels(xy), axis=0)) / 2  # the nearer of two places is no further
    return reach_px(scene.camera, xy.reshape(-1, 2), reach) + float(half_steps.max(initial=0))

"""A render of more pixels than the picture's, for targets so small that a pixel's few rays would miss or overrate them.

A far target's light is then right however small it is: rays go through a frame of fine pixels around it alone, and each
pixel of the picture has the mean of its own. Several bodies, and what motion or the lens blurs, count by their outlines
together: where these are large a small one is rendered by the picture's own pixels.
"""

from dataclasses import replace
from math import ceil, floor

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.region import Region
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene, Shutter

PADDING_PX = 2  # fine ones around the target


def magnified(scene: Scene, by: int) -> Scene:
    """Return the scene as a camera of `by` times more pixels a side sees it, whose frame holds the target alone."""
    return _in_frame(scene, _fine_frame(scene, by), by)


def finer(scene: Scene, by: int) -> tuple[Scene, Region]:
    """Return the same, of a target of any size, as far as the picture shows it: the scene, and its frame in fine
    pixels, counted from the picture's corner."""
    whole = Region.full(scene.camera.width * by, scene.camera.height * by)
    frame = whole if scene.outline_box is None else _fine_frame(scene, by) & whole
    frame = frame.padded(PADDING_PX)  # no renderer takes a frame of a few pixels
    return _in_frame(scene, frame, by), frame


def _in_frame(scene: Scene, frame: Region, by: int) -> Scene:
    camera = scene.camera
    fine = replace(
        camera,
        width=frame.width,
        height=frame.height,
        fx=camera.fx * by,
        fy=camera.fy * by,
        cx=camera.cx * by - frame.x0,
        cy=camera.cy * by - frame.y0,
    )
    return replace(scene, camera=fine, shutter=scene.shutter and _fine_shutter(scene.shutter, frame, by, camera.height))


def gathered(fine: Radiance, scene: Scene, by: int) -> Radiance:
    """Return the radiance of `scene.picture_region` from that of `magnified(scene, by)`."""
    region, frame = scene.picture_region, _fine_frame(scene, by)
    down = _means(frame.y0 + fine.region.y0, fine.region.height, region.y0, region.height, by)
    across = _means(frame.x0 + fine.region.x0, fine.region.width, region.x0, region.width, by)
    groups = np.einsum("ai,gijc,bj->gabc", down, fine.groups.astype(np.float64), across)
    coverage = down @ fine.coverage.astype(np.float64) @ across.T
    return Radiance(
        region=region, groups=groups.astype(np.float32), coverage=np.minimum(coverage, 1).astype(np.float32)
    )


def _fine_frame(scene: Scene, by: int) -> Region:
    """Return the fine pixels around the target, counted from the picture's corner."""
    box = scene.outline_box
    assert box is not None
    (x0, y0), (x1, y1) = box.tolist()
    around = Region(x0=floor(x0 * by), y0=floor(y0 * by), x1=ceil(x1 * by), y1=ceil(y1 * by))
    return around.padded(PADDING_PX)


def _fine_shutter(shutter: Shutter, frame: Region, by: int, rows: int) -> Shutter:
    """Return the shutter by which the fine rows are exposed as the picture's are in which they lie."""
    first, last = (((row + 0.5) / by - 0.5) / max(rows - 1, 1) for row in (frame.y0, frame.y1 - 1))
    return replace(shutter, first_row=first, last_row=last)


def _means(start: int, count: int, first: int, pixels: int, by: int) -> Float:
    """Return the matrix (pixels, count) that gives pixels from `first` on the mean of the fine ones from `start` on."""
    own = (start + np.arange(count)) // by - first
    return np.asarray((own == np.arange(pixels)[:, None]) / by)

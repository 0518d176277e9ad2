"""Dense pose: the point of a target that each pixel shows."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_position
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene

REPROJECTION_PX = 1e-3  # float32 body coordinates of a metre-sized target: 1e-4 px at SPEED+'s closest range
STRETCHED = 2  # magnification by a lens of a small distance at the rim of a picture


def dense_pose(scene: Scene, surface: Surface) -> NDArray[np.float32]:
    """Return (H, W, 3) float32: X, Y, Z in the body frame of the target that is seen, metres; 0 where none is."""
    return surface.image(surface.body, np.float32, surface.of_targets)


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Points are given for the targets' pixels alone, and each projects onto the centre of its own pixel."""
    if picture.points_cam is None or picture.target_pixels is None or picture.target_ids is None:
        return
    rows, columns = picture.target_pixels
    if picture.arrays["dense_pose"][picture.target_ids == 0].any():
        yield LabelFault(code="support", message="dense pose covers pixels outside the segmentation")
    centres = np.stack([columns + 0.5, rows + 0.5], -1)
    rounding = picture.rounding * max(picture.camera.fx, picture.camera.fy) / picture.points_cam[:, 2]
    away = np.abs(picture.camera.project(picture.points_cam) - centres).max(1, initial=0)
    off = (away - STRETCHED * rounding).max(initial=0)
    if not off <= REPROJECTION_PX:
        yield LabelFault(code="reprojection", message=f"dense pose projects {off:.3g} px beside its pixels")


DENSE_POSE = Label(
    name="dense_pose",
    make=dense_pose,
    channels=Channels(
        meaning="the surface point in the target's body frame, x, y, z in metres: float32 channels R, G, B; "
        "0 = nothing",
        dtype="float32",
        holds={"R": "x", "G": "y", "B": "z"},
        unit="m",
        frame="body",
    ),
    suffix=".exr",
    usd_type="point3f",
    file_bytes=4.0,
    preview=by_position,
    faults=faults,
    default=True,
)

"""NOCS: the dense pose as shares of the target's box, 16 bits each.

NOCS is after H. Wang et al., "Normalized Object Coordinate Space for Category-Level 6D Object Pose and Size Estimation"
(2019), who divide all axes by the box's diagonal; here each axis goes from end to end of its own, so that 16 bits hold
more, and the box that the record has in box_3d brings back metres.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import image
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.surface import Rows, Surface
from spin_usd.scene.scene import OneBody, Scene

STEPS = 65534  # from one end of the box, 1, to the other, 65535: 0 is nothing
FLOAT32 = 1.2e-7  # of the coordinates in a dense pose


def nocs(scene: Scene, surface: Surface) -> NDArray[np.uint16]:
    """Return (H, W, 3) uint16: x, y and z in the body frame of the target that is seen, each 1 at its box's least and
    65535 at its greatest; 0 where none is."""

    def numbers(one: OneBody, rows: Rows) -> Float:
        return normalised(surface.body[rows], one.target.mesh.box)

    return surface.image_of(numbers, (3,), np.uint16, targets_alone=True)


def normalised(body: Float, box: Float) -> Float:
    """Return (N, 3) whole numbers 1 to 65535 of the points (N, 3) in a box (2, 3); 1 along an axis that has no
    length."""
    low, high = box
    share = (body - low) / np.where(high > low, high - low, 1)
    numbers: Float = 1 + np.rint(STEPS * np.clip(share, 0, 1))
    return numbers


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """NOCS is given where the dense pose is, and brings back its points."""
    points, ids, numbers = picture.arrays.get("dense_pose"), picture.target_ids, picture.arrays["nocs"]
    if points is None or ids is None:
        return
    if ((ids > 0) != (numbers > 0).all(-1)).any():
        yield LabelFault(code="support", message="dense pose and nocs cover different pixels")
        return
    for number, (low, high) in picture.boxes.items():
        step, of = (high - low) / STEPS, ids == number
        off = np.abs(low + (numbers[of] - 1.0) * step - points[of])
        if not (off <= step / 2 + FLOAT32 * np.maximum(np.abs(low), np.abs(high))).all():
            yield LabelFault(code="nocs", message=f"nocs and dense pose differ by {off.max():.3g} m")


NOCS = Label(
    name="nocs",
    make=nocs,
    channels=Channels(
        meaning="the surface point as shares of the target's box along its body axes x, y, z: 16-bit R, G, B, "
        "1 = the box's least, 65535 = its greatest, 0 = nothing",
        dtype="uint16",
        holds={"R": "x", "G": "y", "B": "z"},
        frame="body",
    ),
    suffix=".png",
    usd_type="int3",
    file_bytes=3.0,
    target_s=4e-08,
    preview=image,
    faults=faults,
)

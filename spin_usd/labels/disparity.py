"""Disparity: how much further left, and further up, the surface point that each pixel shows lies in the picture of the
camera that is paired with this one.

Of a rectified pair, whose cameras have equal K, parallel axes and a baseline b along x, that is fx b / z to the left,
and 0 up: positive in the left camera's picture, negative in the right one's.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.displacement import HOLDS, OFF_PX, decided_by, displacement, largest_error
from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_motion
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene

NAME = "disparity"


def disparity(scene: Scene, surface: Surface) -> NDArray[np.float32]:
    """Return (H, W, 3) float32: pixels to the left and up from here to the paired camera's picture, and the PointState
    there; as `displacement` has it."""
    return _turned(displacement(scene, surface, scene.paired))


def _turned(moves: NDArray[Any]) -> NDArray[Any]:
    """Return displacements (H, W, 3) the other way round: right and down as left and up, and back."""
    return np.asarray(moves * np.array([-1, -1, 1], moves.dtype) + moves.dtype.type(0))  # no negative zeros


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Disparity takes each pixel to where the paired camera sees the dense pose's point."""
    found = picture.arrays[NAME]
    if picture.paired is None:
        if found.any():
            yield LabelFault(code=NAME, message="disparity is not 0 in a picture whose record names no paired camera")
        return
    worst = largest_error(picture, _turned(found), picture.paired)
    if not worst <= OFF_PX:
        yield LabelFault(code=NAME, message=f"disparity ends {worst:.3g} px beside the dense pose's points")


DISPARITY = Label(
    name=NAME,
    make=disparity,
    decided_by=lambda scene: decided_by(scene, scene.paired),
    takes="paired",
    channels=Channels(
        meaning="how much further left and up the surface point lies in the paired camera's picture, pixels, and what "
        f"becomes of it: float32 channels R, G, B; B {HOLDS}; 0 = nothing",
        dtype="float32",
        holds={"R": "left", "G": "up", "B": "what becomes of the point"},
        unit="px",
    ),
    suffix=".exr",
    usd_type="float3",
    file_bytes=4.0,
    target_s=3.5e-07,
    preview=by_motion,
    faults=faults,
)

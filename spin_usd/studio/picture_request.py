"""A request for a picture of an open stage, and the users' values that it consists of."""

from collections.abc import Mapping
from math import isfinite
from numbers import Real
from operator import index
from typing import Any

import numpy as np
from msgspec import Struct

from spin_usd.basics.arrays import digest
from spin_usd.errors import GeometryError, InputError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.poses import FRAME_NAME, FRAME_NAME_RULE

NAME_DIGITS = 12
LONGEST = 60  # characters of a value in a message

Matrix = list[list[float]]


class DrawnFrom(Struct, frozen=True, kw_only=True):
    """The source of a picture in a stream."""

    seed: int
    number: int
    """Number of the picture in the stream."""
    poses: str | None = None
    """A sampling specification: its text, file or name; None if the request has the pose."""
    spec: str | None = None
    """The file of a specification of augmentations, one of which the picture takes; None for none."""


class PictureRequest(Struct, frozen=True, kw_only=True):
    """A request for a picture: a frame of the stage, and changes to it."""

    frame: str | None = None
    """Name of the frame, or its place as text; None for the first."""
    variant: str | None = None
    """Variant; None for the simulator's own."""
    time: float | None = None
    """Seconds of the stage, instead of a frame's."""
    name: str | None = None
    """Name of the picture, which decides its noise; made from its poses if None."""
    seed: int | None = None
    """Seed of all random values; None for the simulator's own."""
    poses: dict[str, Matrix] = {}
    """T_cam_body by target; "" is the first."""
    parts: dict[str, Matrix] = {}
    """New places of parts of the first target, by part: target's axes, metres."""
    lights: dict[str, float] = {}
    """Factors on strengths by light."""
    values: dict[str, Any] = {}
    """Values of parameters by name, each in its own unit; of "background" the file of a photograph."""
    selections: dict[str, str] = {}
    """Variants of the stage's other sets, by set."""
    drawn: DrawnFrom | None = None
    """Source of the remaining values, drawn before the picture is made."""

    @property
    def called(self) -> str | None:
        """The picture's name; None for its frame's. Raises InputError if it cannot name a picture."""
        if self.name is not None and not FRAME_NAME.fullmatch(self.name):
            raise InputError(f"{shortened(self.name)} cannot name a picture", do=FRAME_NAME_RULE)
        if self.name or not (self.poses or self.parts or self.time is not None):
            return self.name
        own = [self.time, sorted(self.poses.items()), sorted(self.parts.items())]
        return f"pose_{digest([self.frame, repr(own)])[:NAME_DIGITS]}"


def pose_matrix(pose: Any, what: str) -> Matrix:
    """Return a pose as rows of a (4, 4) matrix: given as such, or as a quaternion (4,), scalar first, and a translation
    (3,). Raises InputError unless it is the pose of a rigid body."""
    try:
        if isinstance(pose, tuple | list) and len(pose) == 2:
            q, t = (np.asarray(each, np.float64) for each in pose)
            checked = Transform.from_quaternion(to="to", of="of", q=q, t=t)
        else:
            found = np.asarray(pose, np.float64)
            if found.shape != (4, 4):
                raise ValueError(f"its shape is {found.shape}")
            if not np.array_equal(found[3], (0, 0, 0, 1)):
                raise ValueError(f"its last row is {', '.join(f'{each:g}' for each in found[3])}")
            checked = Transform(to="to", of="of", rotation=found[:3, :3], translation=found[:3, 3])
    except (GeometryError, TypeError, ValueError) as error:
        do = "give a (4, 4) matrix, or a quaternion and a translation"
        raise InputError(f"{what} is not a pose ({error})", do=do) from None
    matrix: Matrix = checked.matrix.tolist()
    return matrix


def finite_number(value: Any, what: str) -> float:
    """Return a number of a user. Raises InputError unless it is a finite number."""
    if isinstance(value, bool) or not isinstance(value, Real) or not isfinite(value):
        raise InputError(f"{what} is {shortened(value)}", do="give a finite number")
    return float(value)


def whole_number(value: Any, what: str) -> int:
    """Return a whole number of a user. Raises InputError for any other value."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise InputError(f"{what} is {shortened(value)}", do="give a whole number")
    return index(value)


def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values of parameters as for JSON: numbers, text, booleans, and lists of these. Raises InputError."""
    return {str(name): _plain(str(name), value) for name, value in values.items()}


def _plain(name: str, value: Any) -> Any:
    value = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    if isinstance(value, list | tuple):
        return [_plain(name, each) for each in value]
    if isinstance(value, bool | str):
        return value
    return index(value) if hasattr(value, "__index__") else finite_number(value, name)


def shortened(value: Any) -> str:
    """Return a value as text for a message."""
    text = repr(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."

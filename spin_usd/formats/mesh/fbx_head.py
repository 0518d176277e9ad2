"""An FBX file's axes, unit and presence of animations, without its geometry, which Blender reads.

Blender turns imported models to its own axes and does not report the rotation. Binary files and text hold the same
properties; only their presence matters, so no node is followed.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.files.user_file import read_bytes

Y_UP_FROM_BLENDER = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""To the right, up and to the front in Blender's axes."""
MISSING = 99
NAMES = ("CoordAxis", "UpAxis", "FrontAxis")


@dataclass(frozen=True, kw_only=True, eq=False)
class FbxHead:
    """Global settings of an FBX file."""

    from_blender: Float | None
    """(3, 3): from Blender's axes to the file's own; None if it does not state them."""
    up: str
    """The name of the axis that it calls up."""
    says_unit: bool
    """True if the file states its unit."""
    moves: bool
    """True if the file has animations."""


def read_fbx_head(path: Path) -> FbxHead:
    """Read it from the file at `path`. Raises InputError if the file cannot be opened."""
    data = read_bytes(path, MAX_MODEL)
    axes, signs = ([_number(data, name + end) for name in NAMES] for end in ("", "Sign"))
    matrix, up = None, ""
    if sorted(axes) == [0, 1, 2] and all(sign in (1, -1) for sign in signs):
        own = np.eye(3)[axes] * np.array(signs)[:, None]
        up = "-" * (signs[1] == -1) + "xyz"[axes[1]]
        if np.linalg.det(own) > 0:  # Blender mirrors others, and leaves them right-handed
            matrix = own.T @ Y_UP_FROM_BLENDER
    return FbxHead(
        from_blender=matrix, up=up, says_unit=b"UnitScaleFactor" in data, moves=b"AnimationCurveNode" in data
    )


def _number(data: bytes, name: str) -> int:
    """Return the whole number of a property, MISSING where it is not there."""
    key = name.encode()
    binary = re.search(b"S" + len(key).to_bytes(4, "little") + key + rb"(?:S.{4}[A-Za-z]*){3}I(.{4})", data, re.DOTALL)
    if binary:
        return int.from_bytes(binary[1], "little", signed=True)
    text = re.search(rb'"' + key + rb'"[^\r\n]*,\s*(-?\d+)\s*$', data, re.MULTILINE)
    return int(text[1]) if text else MISSING

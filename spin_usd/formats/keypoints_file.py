"""Keypoints of a model: JSON, CSV or TOML; body axes, metres."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.errors import InputError
from spin_usd.formats.table_file import Row, Table, read_table
from spin_usd.scene.keypoints import Keypoints

TABLE = Table(key="name", required=("x", "y", "z"))


def read_keypoints_file(path: str | Path) -> Keypoints:
    """Read the keypoints of the file at `path`, in its order. Raises InputError that names the file and the row."""
    rows = read_table(path, TABLE)
    points = [[_metres(row, axis) for axis in TABLE.required] for row in rows]
    return Keypoints(names=tuple(row.name for row in rows), points=np.array(points, np.float64))


def _metres(row: Row, axis: str) -> float:
    given: Any = row.values[axis]
    try:
        number = math.nan if isinstance(given, bool) else float(given)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"has {axis} = {given!r}", where=row.where, do="give finite numbers, metres in the body frame")
    return number

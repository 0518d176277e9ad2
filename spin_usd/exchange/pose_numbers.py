"""The numbers of a pose, as formats write them: each checked, each error with its place."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.text_file import headings_once, is_finite, lines_of
from spin_usd.geometry.rotation import off_rotation, quaternion_from_matrix

ROUNDED = 1e-5  # by which a matrix of six decimals misses being a rotation
FEW_DECIMALS = 1e-3  # by which one of three or four does


def csv_rows(path: Path, *, delimiter: str = ",", skip: int = 0) -> Iterator[tuple[int, str, Mapping[str, str]]]:
    """Yield the line number of each row of a CSV file with headings, its place for messages, and its cells by heading;
    `skip` lines precede them. Raises InputError for a repeated heading, and for a row with more non-empty cells than
    headings."""
    lines = islice(lines_of(path, MAX_POSE_LIST), skip, None)
    rows = csv.DictReader(lines, skipinitialspace=True, delimiter=delimiter)
    headings_once(rows.fieldnames, path)
    for row in rows:
        line = rows.line_num + skip
        where, beyond = f"{path}, line {line}", row.pop(None, ())
        if any(cell.strip() for cell in beyond):
            found = f"has {len(row) + len(beyond)} cells for {len(row)} headings"
            do = f"write numbers with a point, and quote cells that hold {delimiter!r}"
            raise InputError(found, where=where, do=do)
        yield line, where, {key: cell or "" for key, cell in row.items() if key}


def cells(row: Mapping[str, str], columns: Sequence[str], where: str) -> list[float]:
    """Return the numbers in these columns. Raises InputError."""
    for column in columns:
        if column not in row:
            raise InputError(f"has no column {column!r}", where=where, do=f"give {', '.join(columns)}")
    if bad := next((column for column in columns if not is_finite(row[column])), None):
        raise InputError(f"{bad} is {row[bad]!r}, not a finite number", where=where)
    return [float(row[column]) for column in columns]


def finite_numbers(values: Any, count: int, name: str, where: str) -> list[float]:
    """Return `count` finite numbers. Raises InputError that calls them `name`."""
    if not isinstance(values, list) or len(values) != count:
        raise InputError(f"{name} is not a list of {count} numbers", where=where)
    if not all(type(v) in (float, int) for v in values):
        raise InputError(f"{name} contains a value that is not a number: {values!r}", where=where)
    try:
        numbers = [float(v) for v in values]
    except OverflowError:
        numbers = [float("inf")]
    if not all(map(isfinite, numbers)):
        raise InputError(f"{name} holds NaN or infinity", where=where)
    return numbers


def one_pose(
    rotations: Sequence[Sequence[float]], places: Sequence[Sequence[float]], where: str
) -> tuple[Sequence[float], Sequence[float]]:
    """Return the first quaternion and position of one pose in a file. Raises InputError if others contradict them
    beyond rounding."""
    if len(rotations) == len(places) == 1:
        return rotations[0], places[0]
    q, t = np.array(rotations, np.float64), np.array(places, np.float64)
    q = np.where(q @ q[:1].T < 0, -q, q)  # which is the same rotation
    for name, each, size in (("rotations", q, 1.0), ("positions", t, max(np.abs(t).max(), 1.0))):
        if np.abs(each - each[0]).max() > FEW_DECIMALS * size:
            raise InputError(f"has two contradicting {name}", where=where, do="leave one of them out")
    return rotations[0], places[0]


def quaternion_of(rows: Any, name: str, where: str) -> tuple[list[float], float]:
    """Return the unit quaternion, scalar first, of nine numbers, a rotation matrix row by row, and by how much they
    missed being one where six decimals do not account for it. Raises InputError."""
    matrix = np.array(finite_numbers(rows, 9, name, where)).reshape(3, 3)
    off, right_handed = off_rotation(matrix)
    if off > FEW_DECIMALS or not right_handed:
        scale = float(np.linalg.norm(matrix) / np.sqrt(3))
        found = f"{name} is not a rotation (off by {off:.3g})"
        if right_handed and scale and off_rotation(matrix / scale)[0] <= FEW_DECIMALS:
            found = f"{name} is a rotation times {scale:.6g}"
            raise InputError(found, where=where, do="divide it by that; poses have no scale")
        raise InputError(found, where=where, do="give it row by row")
    return list(map(float, quaternion_from_matrix(_nearest_rotation(matrix)))), off if off > ROUNDED else 0.0


def _nearest_rotation(matrix: Float) -> Float:
    """Return the rotation (3, 3) nearest to one that was rounded."""
    u, _, v = np.linalg.svd(matrix)
    return np.asarray(u @ v)

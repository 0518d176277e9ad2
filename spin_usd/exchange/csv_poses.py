"""A table of poses with named columns, as people write their own: CSV with commas, semicolons or tabs.

Columns may be in any order, among others, in any case. The name, if present, is the picture's; q_cam_body is a unit
quaternion, and t_cam_body the origin of the body's axes in the camera's, in metres: p_cam = R(q) p_body + t.
"""

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from datetime import datetime
from math import isfinite
from pathlib import Path

from spin_usd.basics.utc import parsed_utc
from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import cells, csv_rows, one_pose, quaternion_of
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.text_file import delimiter_of, headings_once, lines_of

SUFFIXES = {".csv", ".tsv"}
NAMES = ("name", "filename", "file", "image", "frame", "file_name", "image_name", "img", "id")
"""The first of them that there is names the picture: a number of it may stand beside its file."""
QUATERNIONS = tuple(
    tuple(pattern.format(axis) for axis in "wxyz") for pattern in ("q{}", "q_{}", "quat_{}", "quaternion_{}", "rot_{}")
)
MATRICES = tuple(
    tuple(pattern.format(row + first, column + first) for row in range(3) for column in range(3))
    for pattern in ("r{}{}", "r_{}{}")
    for first in (1, 0)
)
TRANSLATIONS = tuple(
    tuple(pattern.format(axis) for axis in "xyz") for pattern in ("{}", "t{}", "t_{}", "pos_{}", "position_{}", "r_{}")
)
METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "M": 1.0, "MM": 1e-3, "CM": 1e-2, "KM": 1e3}
"""By units as heads have them, some in capitals throughout; "Mm" is a megametre, or is not."""
UTC_HEADS = ("utc", "time_utc")
TIMES = (*UTC_HEADS, "time", "time_s", "seconds")
"""Columns for the time of a pose, of which the first present counts: seconds, or UTC in ISO 8601."""
UNIT = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?")
"""A heading, and the unit that may stand after it in brackets."""
WANTED = (
    "name the columns name, qw, qx, qy, qz, x, y, z, in any order (or q_w, quat_w; tx, t_x, pos_x; r11 to r33 row by "
    "row instead of the quaternion)"
)


def _read(path: Path) -> Iterator[PoseEntry]:
    head = next(lines_of(path, MAX_POSE_LIST), "")
    separator = re.fullmatch(r"sep=(.)\s*", head, re.IGNORECASE)  # of spreadsheets
    delimiter = separator[1] if separator else delimiter_of(head)
    for number, (line, where, row) in enumerate(csv_rows(path, delimiter=delimiter, skip=1 if separator else 0)):
        parts = [UNIT.fullmatch(heading.strip()) for heading in row]
        headings = [part[1].lower() if part else "" for part in parts]
        headings_once(headings, path)
        cell = dict(zip(headings, row.values(), strict=True))
        said = {heading: part[2] or "" for heading, part in zip(headings, parts, strict=True) if part}
        units = {heading: unit or "m" for heading, unit in said.items()}
        name = next((cell[each] for each in NAMES if each in cell), f"img{number:06}")
        quaternions, matrices, places = (_whole(cell, known) for known in (QUATERNIONS, MATRICES, TRANSLATIONS))
        if not (places and quaternions + matrices):
            missing = "rotation" if places else "position"
            raise InputError(f"has no columns of a {missing} among {', '.join(cell)}", where=path, do=WANTED)
        if unknown := {units[column] for columns in places for column in columns} - {*METRES}:
            do = "give the position in m, mm, cm or km"
            raise InputError(f"has a position in {', '.join(sorted(unknown))}", where=path, do=do)
        turns = [quaternion_of(cells(cell, each, where), "the rotation matrix", where) for each in matrices]
        rotation, place = one_pose(
            [*(cells(cell, each, where) for each in quaternions), *(q for q, _ in turns)],
            [[cells(cell, [each], where)[0] * METRES[units[each]] for each in columns] for columns in places],
            where,
        )
        off = 0.0 if quaternions else turns[0][1]
        timed = next((each for each in TIMES if cell.get(each, "").strip()), None)
        time = _time(cell[timed].strip(), said[timed], timed in UTC_HEADS, where) if timed else None
        yield PoseEntry(filename=name, q_cam_body=rotation, t_cam_body=place, line=line, off_rotation=off, time=time)


def _time(text: str, unit: str, utc: bool, where: str) -> float | datetime:
    """Return the time of a cell: seconds, or UTC; that alone below such a head. Raises InputError."""
    if unit not in ("", "s", "UTC", "utc"):
        raise InputError(f"has a time in {unit}", where=where, do="give it in seconds, or as UTC")
    with suppress(ValueError):
        if not utc and "_" not in text and isfinite(seconds := float(text)):
            return seconds
    with suppress(ValueError):
        return parsed_utc(text)
    do = "give seconds, or UTC such as 2026-11-26T12:00:00.5Z"
    raise InputError(f"has the time {text!r}", where=where, do=do)


def _whole(cell: Mapping[str, str], known: tuple[tuple[str, ...], ...]) -> list[tuple[str, ...]]:
    """Return the known groups of columns that are complete in the row."""
    return [columns for columns in known if all(column in cell for column in columns)]


CSV_POSES = PoseFormat(
    name="CSV",
    recognises=lambda path, head: path.suffix.lower() in SUFFIXES,
    read=_read,
    lists=files_like("poses.csv"),
)

"""A table of poses with named columns, as people write their own: CSV with commas, semicolons or tabs.

Columns may stand in any order, beside others, in capitals or not. A name, where there is one, is the picture's;
q_cam_body is a unit quaternion, and t_cam_body the origin of the body's axes in the camera's, in metres:
p_cam = R(q) p_body + t.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import cells, csv_rows, quaternion_of
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.text_file import delimiter_of, lines_of

SUFFIXES = {".csv", ".tsv"}
NAMES = ("name", "filename", "file", "image", "frame", "file_name", "image_name", "img", "id")
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
METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3}
UNIT = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?")
"""A heading, and the unit that may stand after it in brackets."""
WANTED = (
    "name the columns name, qw, qx, qy, qz, x, y, z, in any order (or q_w, quat_w; tx, t_x, pos_x; r11 to r33 row by "
    "row instead of the quaternion)"
)


def _read(path: Path) -> Iterator[PoseEntry]:
    head = next(lines_of(path, MAX_POSE_LIST), "")
    said = re.fullmatch(r"sep=(.)\s*", head, re.IGNORECASE)  # of spreadsheets
    delimiter = said[1] if said else delimiter_of(head)
    for number, (line, where, row) in enumerate(csv_rows(path, delimiter=delimiter, skip=1 if said else 0)):
        parts = {heading: UNIT.fullmatch(heading.strip().lower()) for heading in row}
        cell = {part[1]: row[heading] for heading, part in parts.items() if part}
        units = {part[1]: part[2] or "m" for part in parts.values() if part}
        name = _columns(cell, tuple((each,) for each in NAMES))
        quaternion, matrix = _columns(cell, QUATERNIONS), _columns(cell, MATRICES)
        translation = _columns(cell, TRANSLATIONS)
        if translation is None or (quaternion is None and matrix is None):
            missing = "position" if translation is None else "rotation"
            raise InputError(f"has no columns of a {missing} among {', '.join(cell)}", where=path, do=WANTED)
        if unknown := {units[column] for column in translation} - {*METRES}:
            do = f"give the position in {', '.join(METRES)}"
            raise InputError(f"has a position in {', '.join(sorted(unknown))}", where=path, do=do)
        rotation, off = (
            (cells(cell, quaternion, where), 0.0)
            if quaternion
            else quaternion_of(cells(cell, matrix or (), where), "the rotation matrix", where)
        )
        place = zip(cells(cell, translation, where), translation, strict=True)
        yield PoseEntry(
            filename=cell[name[0]] if name else f"img{number:06}",
            q_cam_body=rotation,
            t_cam_body=[value * METRES[units[column]] for value, column in place],
            line=line,
            off_rotation=off,
        )


def _columns(cell: Mapping[str, str], known: tuple[tuple[str, ...], ...]) -> tuple[str, ...] | None:
    """Return the first of the known groups of columns that the row has whole."""
    return next((columns for columns in known if all(column in cell for column in columns)), None)


CSV_POSES = PoseFormat(
    name="CSV",
    recognises=lambda path, head: path.suffix.lower() in SUFFIXES,
    read=_read,
    lists=files_like("poses.csv"),
)

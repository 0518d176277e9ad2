"""A table of poses with named columns, as people write their own: CSV with commas, semicolons or tabs.

Columns may be in any order, among others, in any case; ROS's fields, such as field.pose.position.x, are columns too.
The name, if present, is the picture's; q_cam_body is a unit quaternion, and t_cam_body the origin of the body's axes in
the camera's, in metres: p_cam = R(q) p_body + t.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from spin_usd.basics.utc import parsed_utc
from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import cells, csv_rows, one_pose, quaternion_of
from spin_usd.exchange.pose_times import PLACES, PoseTimes
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.text_file import delimiter_of, headings_once, is_finite, lines_of

SUFFIXES = {".csv", ".tsv"}
NAMES = ("name", "filename", "file", "image", "frame", "file_name", "image_name", "img", "id")
"""The first of them that there is names the picture: a number of it may stand beside its file."""
ROS = re.compile(r"[%#\s]*(?:(?:field|header|pose|transform)\.)*")
"""The beginning of headings that ROS writes for the fields of its messages."""
ROTATIONS = ("orientation_{}", "rotation_{}")
QUATERNIONS = tuple(
    tuple(pattern.format(axis) for axis in "wxyz")
    for pattern in ("q{}", "q_{}", "quat_{}", "quaternion_{}", "rot_{}", *ROTATIONS)
)
MATRICES = tuple(
    tuple(pattern.format(row + first, column + first) for row in range(3) for column in range(3))
    for pattern in ("r{}{}", "r_{}{}")
    for first in (1, 0)
)
TRANSLATIONS = tuple(
    tuple(pattern.format(axis) for axis in "xyz")
    for pattern in ("{}", "t{}", "t_{}", "pos_{}", "position_{}", "r_{}", "translation_{}")
)
METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "M": 1.0, "MM": 1e-3, "CM": 1e-2, "KM": 1e3}
"""By units as heads have them, some in capitals throughout; "Mm" is a megametre, or is not."""
UTC_HEADS = ("utc", "time_utc", "date", "datetime")
TIMES = (*UTC_HEADS, "stamp", "timestamp", "time", "t", "seconds")
"""Columns for the time of a pose, of which the first present counts: a number, or UTC in ISO 8601."""
TIME = re.compile(rf"({'|'.join(TIMES)})(?:_({'|'.join(PLACES)}))?")
"""Such a column, and the unit that its name may end in."""
LIKE_TIME = re.compile(r"(?:^|_)(?:utc|date\w*|\w*time|\w*stamp|epoch|n?sec\w*)(?:_|$)|^t$")
PARTS = {"secs": "nsecs", "sec": "nanosec"}
"""Units of a stamp of ROS in two columns."""
UNIT = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?")
"""A heading, and the unit that may stand after it in brackets."""
WANTED = (
    "name the columns name, qw, qx, qy, qz, x, y, z, in any order (or q_w, quat_w; tx, t_x, pos_x; r11 to r33 row by "
    "row instead of the quaternion)"
)


def _read(path: Path) -> Iterator[PoseEntry | str]:
    head = next(lines_of(path, MAX_POSE_LIST), "")
    separator = re.fullmatch(r"sep=(.)\s*", head, re.IGNORECASE)  # of spreadsheets
    delimiter = separator[1] if separator else delimiter_of(head)
    timed, times = "", PoseTimes()
    for number, (line, where, row) in enumerate(csv_rows(path, delimiter=delimiter, skip=1 if separator else 0)):
        parts = [UNIT.fullmatch(heading.strip()) for heading in row]
        headings = [ROS.sub("", part[1].lower(), count=1).replace(".", "_") if part else "" for part in parts]
        headings_once(headings, path)
        cell = dict(zip(headings, row.values(), strict=True))
        said = {heading: part[2] or "" for heading, part in zip(headings, parts, strict=True) if part}
        units = {heading: unit or "m" for heading, unit in said.items()}
        name = next((cell[each] for each in NAMES if each in cell), f"img{number:06}")
        quaternions, matrices, places = (_whole(cell, known) for known in (QUATERNIONS, MATRICES, TRANSLATIONS))
        if not (places and quaternions + matrices):
            missing = "rotation" if places else "position"
            raise InputError(f"has no columns of a {missing} among {', '.join(row)}", where=path, do=WANTED)
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
        if number == 0:
            timed, times = _times(cell, said, where)
            yield from _notes(cell, timed, row)
        time = _time(cell, timed, times, where) if cell.get(timed, "").strip() else None
        if number == 0 and times.by_size:
            yield times.note
        yield PoseEntry(
            filename=name,
            q_cam_body=rotation,
            t_cam_body=place,
            line=line,
            off_rotation=off,
            time=time,
            epoch=times.epoch,
        )


def _notes(cell: Mapping[str, str], timed: str, headings: Iterable[str]) -> Iterator[str]:
    """Yield notes on whose poses these are, and on columns of time that are not read."""
    if any("." in ROS.match(heading)[0] for heading in headings):  # type: ignore[index]
        frame = f" in {cell['frame_id']!r}" if cell.get("frame_id") else ""
        yield (
            f"is ROS's CSV: its poses{frame} are taken for the target's in the camera's axes; where they are the "
            "camera's in a world, write them as TUM: time x y z qx qy qz qw"
        )
    if others := [each for each in cell if LIKE_TIME.search(each) and each not in (timed, _other_part(timed))]:
        used = f"the column {timed!r} is the time" if timed else "name the column of times time, or time [ms]"
        yield f"has columns of times that are not read, {', '.join(map(repr, others))}: {used}"


def _times(cell: Mapping[str, str], said: Mapping[str, str], where: str) -> tuple[str, PoseTimes]:
    """Return the column of times, "" if there is none, and how its times are read. Raises InputError."""
    matches = [match for head in cell if cell[head].strip() and (match := TIME.fullmatch(head))]
    if not matches:
        return "", PoseTimes()
    match = min(matches, key=lambda each: TIMES.index(each[1]))
    unit = (said[match[0]] or match[2] or "").lower()
    if unit not in ("", "utc", *PLACES):
        raise InputError(f"has a time in {unit}", where=where, do="give it in s, ms, us or ns, or as UTC")
    return match[0], PoseTimes(unit.removeprefix("utc"))


def _other_part(timed: str) -> str:
    """Return the column of nanoseconds beside one of whole seconds."""
    base, _, unit = timed.rpartition("_")
    return f"{base}_{PARTS.get(unit, '')}"


def _time(cell: Mapping[str, str], timed: str, times: PoseTimes, where: str) -> float | datetime:
    """Return the time of a row: seconds, or UTC; that alone below such a head. Raises InputError."""
    text = cell[timed].strip()
    with suppress(ValueError):
        if timed in UTC_HEADS or not is_finite(text):
            return parsed_utc(text)
    if timed in UTC_HEADS:
        do = "give UTC such as 2026-11-26T12:00:00.5Z"
        raise InputError(f"has the time {text!r} in the column {timed}", where=where, do=do)
    if part := cell.get(_other_part(timed), "").strip():
        text = f"{text}.{part.zfill(9)}"
    return times.seconds(text, where)


def _whole(cell: Mapping[str, str], known: tuple[tuple[str, ...], ...]) -> list[tuple[str, ...]]:
    """Return the known groups of columns that are complete in the row."""
    return [columns for columns in known if all(column in cell for column in columns)]


CSV_POSES = PoseFormat(
    name="CSV",
    recognises=lambda path, head: path.suffix.lower() in SUFFIXES,
    read=_read,
    lists=files_like("poses.csv"),
)

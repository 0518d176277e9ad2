"""The pose lists of SPEED+, SPEED, SHIRT and SPIN, which are one format: JSON.

A bare list or {"poses": [...]} of entries with a file name, a scalar-first quaternion q_cam_body and a position
t_cam_body in metres. The sets call the quaternion `q_vbs2tango_true` (SPEED: `q_vbs2tango`) and the position
`r_Vo2To_vbs_true`. Source: tpark94/speedplusbaseline, vpulab/SPIN.
"""

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import finite_numbers
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.files.user_file import open_file
from spin_usd.formats.json_file import read_json_file

QUATERNION_KEYS = ("q_vbs2tango_true", "q_vbs2tango")
POSITION_KEYS = ("r_Vo2To_vbs_true", "r_Vo2To_vbs")
INDEX, INDEX_BYTES = b'"wids_version"', 200  # of WebDataset
NAMES = ("train", "validation", "test", "real", "real_test", "roe1", "roe2", "poses")


def read(path: Path) -> Iterator[PoseEntry]:
    """Read the entries of the JSON file at `path`. Raises InputError that names the file and the entry."""
    for i, entry in enumerate(_entries(read_json_file(path, MAX_POSE_LIST), path)):
        where = f"{path}, entry {i}"
        if not isinstance(entry, dict):
            raise InputError(f"is a {type(entry).__name__}, expected an object", where=where)
        filename = entry.get("filename")
        if "filename" not in entry:
            raise InputError("has no 'filename'", where=where, do="name the picture's file")
        if not isinstance(filename, str):
            found = f"has the filename {json.dumps(filename)[:80]}, which is not text"
            raise InputError(found, where=where, do="name the picture's file")
        where = f"{where} ({filename[:80]!r})"
        yield PoseEntry(
            filename=filename,
            q_cam_body=_numbers(entry, QUATERNION_KEYS, 4, where),
            t_cam_body=_numbers(entry, POSITION_KEYS, 3, where),
        )


def _entries(document: Any, path: Path) -> Sequence[Any]:
    if isinstance(document, dict):
        document = document.get("poses")
    if not isinstance(document, list):
        raise InputError("holds no list of poses", where=path, do='give a list, or {"poses": [...]}')
    return document


def _numbers(entry: dict[str, Any], keys: tuple[str, ...], count: int, where: str) -> list[float]:
    """`count` finite numbers under the first of `keys` that is there."""
    key = next((k for k in keys if k in entry), None)
    if key is None:
        raise InputError(f"has neither '{keys[0]}' nor '{keys[1]}'", where=where)
    return finite_numbers(entry[key], count, f"'{key}'", where)


def _lists(folder: Path) -> Sequence[Path]:
    """Return the files of the sets' names in the folder but indices of WebDataset's shards, which have them too."""
    named = files_like(*(f"{place}{name}.json" for place in ("", "*/") for name in NAMES))(folder)
    return [file for file in named if not _begins_with(file, INDEX)]


def _begins_with(file: Path, words: bytes) -> bool:
    """Return whether the words are among the first of the file; one that cannot be read is left to the reader."""
    with suppress(InputError, OSError), open_file(file, MAX_POSE_LIST) as opened:
        return words in opened.read(INDEX_BYTES)
    return False


SPEEDPLUS = PoseFormat(
    name="SPEED+",
    recognises=lambda path, head: True,  # the last to be asked: its reader says what is wrong with a file
    read=read,
    lists=_lists,
)

"""The poses of a dataset of spin_usd's own: its records, which are JSON."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat
from spin_usd.exchange.pose_numbers import finite_numbers
from spin_usd.files.size_limits import MAX_RECORD
from spin_usd.formats.json_file import read_json_file
from spin_usd.scene.scene import NOMINAL

SCHEMA = '"schema": "record-1"'


def read(path: Path) -> Iterator[PoseEntry]:
    """Read the record at `path`. Raises InputError that names it."""
    yield pose_of_record(read_json_file(path, MAX_RECORD), str(path))


def _records(dataset: Path) -> Sequence[Path]:
    """Return the records of the pictures without augmentation, or of the first variant there is, in the stage's
    order."""
    variants = sorted(folder for folder in dataset.glob("records/*") if folder.is_dir())
    nominal = [folder for folder in variants if folder.name == NOMINAL]
    files = [file for folder in (nominal or variants)[:1] for file in folder.glob("*.json")]
    return sorted(files, key=lambda file: (_index(file), file.name))


def _index(file: Path) -> int:
    record = read_json_file(file, MAX_RECORD)
    index = record.get("index") if isinstance(record, dict) else None
    return index if isinstance(index, int) else 0


def pose_of_record(record: Any, where: str, name: str | None = None) -> PoseEntry:
    """Return the pose of a record; the picture is called after its frame, or `name`. Raises InputError."""
    pose = record.get("pose") if isinstance(record, dict) else None
    if not isinstance(pose, dict):
        raise InputError("is not a record with a pose", where=where, do="give one that spin-usd render wrote")
    return PoseEntry(
        filename=name or str(record.get("frame", "")),
        q_cam_body=finite_numbers(pose.get("q_cam_body"), 4, "q_cam_body", where),
        t_cam_body=finite_numbers(pose.get("t_cam_body"), 3, "t_cam_body", where),
    )


RECORD = PoseFormat(
    name="spin_usd's own",
    recognises=lambda path, head: path.suffix == ".json" and SCHEMA in head,
    read=read,
    lists=_records,
)

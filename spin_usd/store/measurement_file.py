"""Find and read a stage's measurement."""

from pathlib import Path

from msgspec import convert

from spin_usd.accuracy.measurement import Measurement
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.files.user_file import read_bytes
from spin_usd.store.json_schema import valid

FOLDER = "measured"
FILE = "measure.json"


def folder_of(stage: Path) -> Path:
    """Return the folder of a stage's measurement, beside the stage's root layer."""
    return stage.parent / FOLDER


def measurement_file(stage: Path, measured: Path | None = None) -> Path:
    """Find the file of the stage's own measurement, or of the one in `measured`, a folder or the file itself. Raises
    InputError if there is none."""
    if measured is not None:
        return measured / FILE if measured.is_dir() else measured
    file = folder_of(stage) / FILE
    if not file.is_file():
        raise InputError(f"has no {FOLDER}/{FILE} beside it", where=stage, do=f"run spin-usd measure {stage} first")
    return file


def read_measurement(file: Path) -> Measurement:
    """Read a measurement. Raises InputError for a file that does not hold one, or holds one of other formulas, or
    figures of pictures that it lacks."""
    try:
        found = convert(valid(read_bytes(file, MAX_DOCUMENT), "measure-1", file), Measurement)
        if strange := {each.frame for each in found.figures} - {frame.name for frame in found.frames}:
            raise InputError(f"has figures of {min(strange)}, which is not among its pictures")
        return found
    except InputError as e:
        raise InputError(e.found, where=file, do="measure again with spin-usd measure") from e

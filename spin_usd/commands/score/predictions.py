"""Predictions as networks' users write them: poses in CSV or JSON, or keypoints in COCO's form."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.json_file import read_json_file
from spin_usd.formats.text_file import delimiter_of, headings_once, lines_of

COLUMNS = ("qw", "qx", "qy", "qz", "x", "y", "z")
QUATERNIONS = ("q_vbs2tango_true", "q_vbs2tango", "q_cam_body")
POSITIONS = ("r_Vo2To_vbs_true", "r_Vo2To_vbs", "t_cam_body")
HALF_PIXEL = 0.5  # COCO counts keypoints from the first pixel's centre
IMAGES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".exr")
DO = f"give CSV with {', '.join(('filename', *COLUMNS))}, or a JSON list of poses or of COCO keypoint results"


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """A prediction for one picture."""

    picture: str
    """Its name without the image's ending."""
    variant: str | None
    """None if the file does not state it."""
    pose: Float | None
    """(7,): quaternion, scalar first, and position, metres, as in the file; NaN for text that is not a number."""
    keypoints: Float | None
    """(K, 3): x, y in pixels from the image's corner, and a weight, 0 for none."""
    where: str
    """Where it stands, for messages."""


def read_predictions(path: Path, annotations: Path | None = None) -> tuple[Prediction, ...]:
    """Read the predictions at `path`. Raises InputError that names the file and the row at fault."""
    csv_like = path.suffix.lower() in (".csv", ".txt")
    found = tuple(_of_csv(path) if csv_like else _of_json(path, annotations))
    if not found:
        raise InputError("holds no predictions", where=path, do=DO)
    return found


def _of_csv(path: Path) -> Iterator[Prediction]:
    """Yield the rows; without headings the columns are those of the SPEED challenge's submissions."""
    headings: Sequence[str] = ("filename", *COLUMNS)
    delimiter = delimiter_of(next(lines_of(path, MAX_POSE_LIST), ""))
    rows = csv.reader(lines_of(path, MAX_POSE_LIST), skipinitialspace=True, delimiter=delimiter)
    for number, row in enumerate(rows, start=1):
        cells, where = [cell.strip() for cell in row], f"{path}, line {number}"
        if not any(cells):
            continue
        if number == 1 and "qw" in (small := [cell.lower() for cell in cells]):
            headings = small
            headings_once(headings, where)
            if lacking := [name for name in ("filename", *COLUMNS) if name not in headings]:
                raise InputError(f"has no column {lacking[0]!r}", where=where, do=DO)
            continue
        if len(cells) != len(headings):
            raise InputError(f"has {len(cells)} cells, expected {len(headings)}", where=where, do=DO)
        named = dict(zip(headings, cells, strict=True))
        values = [_number(named[name]) for name in COLUMNS]
        yield _pose(named["filename"], named.get("variant"), values, where)


def _of_json(path: Path, annotations: Path | None) -> Iterator[Prediction]:
    document = read_json_file(path, MAX_POSE_LIST)
    if isinstance(document, dict):
        document = document.get("poses", document.get("predictions"))
    if not isinstance(document, list):
        raise InputError("holds no list of predictions", where=path, do=DO)
    names: Mapping[Any, str] | None = None
    for number, entry in enumerate(document):
        where = f"{path}, entry {number}"
        if not isinstance(entry, dict):
            raise InputError(f"is a {type(entry).__name__}, expected an object", where=where, do=DO)
        if "keypoints" in entry:
            names = _image_names(annotations) if names is None else names
            yield _keypoints(entry, names, where)
            continue
        pose = [*_values(entry, QUATERNIONS, 4, where), *_values(entry, POSITIONS, 3, where)]
        if not isinstance(entry.get("filename"), str):
            raise InputError("has no 'filename'", where=where, do="name the picture")
        yield _pose(entry["filename"], entry.get("variant"), pose, where)


def _pose(filename: str, variant: Any, values: Sequence[float], where: str) -> Prediction:
    name = _stem(filename)
    pose = np.array(values, np.float64)
    return Prediction(
        picture=name, variant=str(variant) if variant else None, pose=pose, keypoints=None, where=f"{where} ({name!r})"
    )


def _keypoints(entry: Mapping[str, Any], names: Mapping[Any, str], where: str) -> Prediction:
    image = entry.get("image_id")
    if not isinstance(image, str | int) or (isinstance(image, int) and image not in names):
        do = "give --annotations, the COCO file that the images' ids are of, or names as ids"
        raise InputError(f"is of an image {image!r} that nothing names", where=where, do=do)
    values = entry["keypoints"]
    if not isinstance(values, list) or not values or len(values) % 3:
        raise InputError(
            "has keypoints that are not x, y and v of each", where=where, do="write three numbers for each"
        )
    found = np.array([_number(value) for value in values]).reshape(-1, 3)
    found[:, :2] += HALF_PIXEL
    name = _stem(names[image] if isinstance(image, int) else image)
    return Prediction(picture=name, variant=None, pose=None, keypoints=found, where=f"{where} ({name!r})")


def _image_names(annotations: Path | None) -> Mapping[Any, str]:
    """Return the names of the images by their ids."""
    if annotations is None:
        return {}
    document = read_json_file(annotations, MAX_POSE_LIST)
    images = document.get("images") if isinstance(document, dict) else None
    if not isinstance(images, list) or not all(isinstance(each, dict) for each in images):
        raise InputError("has no list of images", where=annotations, do="give a file as COCO has it")
    return {each.get("id"): str(each.get("file_name", "")) for each in images}


def _values(entry: Mapping[str, Any], keys: Sequence[str], count: int, where: str) -> list[float]:
    """Return the numbers under the existing one of the keys, or under several if equal."""
    there = [each for each in keys if each in entry]
    if not there:
        raise InputError(f"has no {keys[0]!r}, {keys[1]!r} or {keys[2]!r}", where=where, do=DO)
    key, *others = there
    if differing := next((each for each in others if entry[each] != entry[key]), None):
        raise InputError(f"has {key!r} and {differing!r}, which differ", where=where, do="leave one of them out")
    values = entry[key]
    if not isinstance(values, list) or len(values) != count:
        raise InputError(f"{key!r} is not a list of {count} numbers", where=where, do=DO)
    return [_number(value) for value in values]


def _number(value: Any) -> float:
    """Return the value as a number; NaN, which is counted later, for any other value."""
    try:
        return nan if isinstance(value, bool) or value is None else float(value)
    except (TypeError, ValueError, OverflowError):
        return nan


def _stem(filename: str) -> str:
    name = filename.replace("\\", "/").rpartition("/")[2]
    stem, dot, suffix = name.rpartition(".")
    return stem if dot + suffix.lower() in IMAGES else name

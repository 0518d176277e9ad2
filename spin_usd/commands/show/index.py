"""The index of a gallery: what the page knows of all pictures before it loads anything of one."""

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd import __version__
from spin_usd.commands.show.data_file import KEY_LENGTH, DataFile
from spin_usd.commands.show.gallery_folder import GalleryFolder
from spin_usd.commands.show.read_records import ReadPicture
from spin_usd.commands.show.values.columns import Column
from spin_usd.commands.show.values.measures import described
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.store.dataset import Dataset

Header = dict[str, Any]
Arrays = dict[str, NDArray[Any]]
DIGEST = re.compile("[0-9a-f]{64}")


def pictures_of(pictures: Sequence[ReadPicture]) -> tuple[Header, Arrays]:
    """Return the pictures in order: the numbers of frame and variant of each, and the key of its image."""
    frames = list(dict.fromkeys(picture.frame for picture in pictures))
    variants = list(dict.fromkeys(picture.variant for picture in pictures))
    keys = "".join(picture.keys.image or "0" * KEY_LENGTH for picture in pictures)
    arrays: Arrays = {
        "frame": _places([picture.frame for picture in pictures], frames),
        "variant": _places([picture.variant for picture in pictures], variants),
        "image": np.frombuffer(bytes.fromhex(keys), np.uint8),
    }
    return {"count": len(pictures), "frames": frames, "variants": variants}, arrays


def _places(names: Sequence[str], among: Sequence[str]) -> NDArray[np.uint32]:
    place = {name: number for number, name in enumerate(among)}
    return np.array([place[name] for name in names], np.uint32)


def measures_of(dataset: Dataset, columns: dict[str, Column], prefix: str = "") -> tuple[list[Header], Arrays]:
    """Return the measures of a dataset that has these columns: what each is, and its numbers, under names that begin
    with the `prefix`. What no picture has stays out."""
    found, arrays = [], {}
    for name, measure, place in described(len(dataset.targets)):
        if name in columns and np.isfinite(columns[name].numbers).any():
            target = None if place is None else dataset.targets[place].name
            found.append({"name": name, "title": measure.title, "unit": measure.unit, "target": target})
            arrays[prefix + name] = columns[name].numbers
    return found, arrays


def columns_of(columns: dict[str, Column], folder: GalleryFolder) -> Iterator[Header]:
    """Write the columns into files of their own, and yield what each is; those of one value alone stay
    out, and digests, which say nothing to people."""
    for name, column in sorted(columns.items()):
        digests = bool(column.words) and all(map(DIGEST.fullmatch, column.words))
        if len(np.unique(column.numbers)) > 1 and not digests:
            file = folder.add(DataFile({"words": column.words}, {"numbers": column.numbers}))
            yield {"name": name, "file": file}


def described_dataset(dataset: Dataset, kinds: Sequence[str]) -> Header:
    """Return what all pictures share: targets, parts, and the labels of these kinds."""
    return {
        "spin_usd": __version__,
        "dataset": dataset.root.name,
        "targets": [_target(target) for target in dataset.targets],
        "parts": {str(part.id): [part.name, part.class_name, part.target] for part in dataset.parts.values()},
        "labels": [_label(kind) for kind in kinds],
    }


def _target(target: Any) -> Header:
    return {
        "id": target.id,
        "name": target.name,
        "size": target.size.tolist(),
        "keypoints": list(target.keypoints.names),
    }


def _label(kind: str) -> Header:
    label = PIXEL_LABELS[kind]
    return {
        "kind": kind,
        "meaning": label.channels.meaning,
        "holds": list(label.channels.holds.values()),
        "unit": label.channels.unit,
        "colours": label.preview.__name__,
    }

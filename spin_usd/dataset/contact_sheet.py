"""A picture of a dataset for people: image, depth, parts and dense pose of some frames side by side."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.dataset.picture.make_picture import IMAGE
from spin_usd.dataset.store.atomic import write_atomically
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.hidden_folder import hidden_folder
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.errors import InputError
from spin_usd.formats.image_file import read_image, write_image
from spin_usd.labels import preview
from spin_usd.labels.table import LABELS

MARGIN = 1.2  # of the box shown to the box that the target covers

TILE_PX = 480
COLUMNS = {IMAGE: preview.image} | {name: label.preview for name, label in LABELS.items()}


def write_contact_sheet(dataset: Path, path: Path, *, frames: int = 8) -> Path:
    """Lay out up to `frames` pictures, spread over the dataset, a row each, as a PNG at `path`."""
    store = Store(root=dataset)
    records = [read_json(record, "record-1") for record in _spread(list(store.records()), frames)]
    if not records:
        raise InputError("holds no picture", where=dataset, do="render it first")
    rows = [_row(store, record) for record in records]
    sheet = preview.contact_sheet(rows, width=TILE_PX)
    with hidden_folder(path.parent, path.name) as hidden:
        write = partial(write_image, array=sheet, channels=("R", "G", "B"))
        write_atomically(path, write, work=hidden.folder)
    return path


def _spread(items: list[Path], count: int) -> list[Path]:
    if len(items) <= count:
        return items
    return [items[i] for i in np.unique(np.linspace(0, len(items) - 1, count).astype(int))]


def _row(store: Store, record: dict[str, Any]) -> list[NDArray[np.uint8]]:
    around = _surroundings(record)
    return [
        in_colours(read_image(store.root / record["files"][kind]["path"])[0][around])
        for kind, in_colours in COLUMNS.items()
        if kind in record["files"]
    ]


def _surroundings(record: dict[str, Any]) -> tuple[slice, slice]:
    """Return the part of the frame around the target, as wide to high as the frame."""
    width, height = record["camera"]["width"], record["camera"]["height"]
    x0, y0, x1, y1 = record["provenance"]["render"]["region"]
    scale = min(max(MARGIN * (x1 - x0) / width, MARGIN * (y1 - y0) / height, TILE_PX / width), 1.0)
    wide, tall = round(scale * width), round(scale * height)
    left = min(max((x0 + x1 - wide) // 2, 0), width - wide)
    top = min(max((y0 + y1 - tall) // 2, 0), height - tall)
    return slice(top, top + tall), slice(left, left + wide)

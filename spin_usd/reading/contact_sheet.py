"""A picture of pictures for people: image, depth, parts and dense pose of some of them side by side."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.formats.image_file import write_image
from spin_usd.labels import preview
from spin_usd.labels.table import CLOUD_LABELS, LABELS
from spin_usd.reading.picture import Picture
from spin_usd.records.record import Record
from spin_usd.store.atomic import fill_atomically
from spin_usd.store.hidden_folder import hidden_folder

MARGIN = 1.2  # of the box shown to the box that the target covers

TILE_PX = 480
COLUMNS = {"image": preview.image} | {name: label.preview for name, label in LABELS.items()}


def write_contact_sheet(pictures: Sequence[Picture], path: Path, *, rows: int = 8) -> Path:
    """Lay out up to `rows` pictures, spread over those given, a row each, as a PNG at `path`."""
    if not pictures:
        raise InputError("there is no picture for a contact sheet", where=path, do="render some first")
    with hidden_folder(path.parent, path.name) as hidden:
        shown = [pictures[place] for place in spread(len(pictures), rows)]
        fill_atomically(Folder(path.parent), path.name, partial(draw_contact_sheet, shown), work=hidden.folder)
    return path


def draw_contact_sheet(pictures: Sequence[Picture], path: Path) -> None:
    """Write the sheet of these pictures, a row each, as .png or .jpg."""
    sheet = preview.contact_sheet([_row(picture) for picture in pictures], width=TILE_PX)
    write_image(path, sheet, channels=("R", "G", "B"))


def spread(total: int, count: int) -> list[int]:
    """Return up to `count` places in a list of `total`, the first and the last among them."""
    places: list[int] = np.unique(np.linspace(0, total - 1, min(count, total)).astype(int)).tolist()
    return places


def _row(picture: Picture) -> list[NDArray[np.uint8]]:
    rows, columns = _surroundings(picture.recorded)
    kinds = ((kind, in_colours) for kind, in_colours in COLUMNS.items() if kind in picture.files)
    arrays = ((picture.label(kind, rows=rows), kind in CLOUD_LABELS, in_colours) for kind, in_colours in kinds)
    return [in_colours(array if cloud else array[:, columns]) for array, cloud, in_colours in arrays]


def _surroundings(record: Record) -> tuple[range, slice]:
    """Return the rows and columns of the frame around the target, as wide to high as the frame."""
    width, height = record.camera.width, record.camera.height
    x0, y0, x1, y1 = record.provenance.render.region
    scale = min(max(MARGIN * (x1 - x0) / width, MARGIN * (y1 - y0) / height, TILE_PX / width), 1.0)
    wide, tall = round(scale * width), round(scale * height)
    left = min(max((x0 + x1 - wide) // 2, 0), width - wide)
    top = min(max((y0 + y1 - tall) // 2, 0), height - tall)
    return range(top, top + tall), slice(left, left + wide)

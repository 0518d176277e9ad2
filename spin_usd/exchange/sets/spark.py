"""SPARK as it lies: poses of stream 2, or boxes, masks and depth of the other streams."""

from collections.abc import Iterator, Mapping

import numpy as np

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget, DepthSource, MaskSource
from spin_usd.exchange.sets.set_folder import SetFolder, cells_or_nan, numbers
from spin_usd.exchange.sets.set_format import PoseFields, SetFormat
from spin_usd.exchange.spark import HEAD, POSITION, QUATERNION
from spin_usd.geometry.camera import Camera

IMAGE_COLUMNS = ("filename", "image", "Image name")
BOX_COLUMNS = {"bbox": (1, 0, 3, 2), "Bounding box": (0, 1, 2, 3)}
"""Columns of boxes, and the places of x0, y0, x1, y1 in them."""
STREAM2_CAMERA = Camera(
    width=1440, height=1080, fx=1744.92206139719, fy=1746.58640701753, cx=737.272795902663, cy=528.471960188736
)
"""Of the challenges' stream 2; the layout has no camera file."""
TABLE = r"(?P<at>(?:.*/)?)(?P<split>[A-Za-z]+)(?:[_ ]labels)?\.csv"


def _tables(folder: SetFolder) -> Iterator[tuple[str, str, str]]:
    """Yield each table, the folder that it is in, with a slash, and its split."""
    for match in folder.matching(TABLE):
        head = folder.head(match.group()).partition("\n")[0].replace(" ", "").strip().lower()
        if head.startswith(HEAD.lower()) or ("class" in head and ("bbox" in head or "boundingbox" in head)):
            yield match.group(), match["at"], match["split"]


def _recognises(folder: SetFolder) -> str:
    name, _, _ = next(_tables(folder), ("", "", ""))
    return f"{name} holds the columns of one of SPARK's streams" if name else ""


def _read_set(folder: SetFolder) -> AnnotatedSet:
    pictures = []
    for name, at, split in _tables(folder):
        for place, row in folder.rows(name):
            said = next((row[column] for column in IMAGE_COLUMNS if column in row), "")
            label, sequence = row.get("class", row.get("Class", "")), row.get("sequence", "")
            folders = (f"{split}/images/{sequence}/", f"images/{sequence}/", f"{split}_rgb/{label}/")
            more = (f"images/{label}/{split}/", f"{split}/", f"{split}/{label}/")
            image = folder.image(said, *(f"{at}{each}" for each in (*folders, *more)))
            depth = folder.first(f"{at}{split}_depth/{label}/{row.get('depth', '')}")
            pictures.append(
                AnnotatedPicture(
                    name=image or f"{sequence}/{said}".removeprefix("/"),
                    exists=bool(image),
                    place=place,
                    split=split,
                    sequence=f"{name} {sequence}",
                    camera=STREAM2_CAMERA if image and "Tx" in row and folder.size(image) == (1440, 1080) else None,
                    targets=(_labelled(folder, row, f"{at}mask/{label}/{split}/", label or "target"),),
                    depth=DepthSource(file=depth, metres=1e-3) if depth else None,
                )
            )
    return AnnotatedSet(pictures=pictures, faults=folder.faults, scalar_last=True, masks_are_lossy=True)


def _labelled(folder: SetFolder, row: Mapping[str, str], masks: str, label: str) -> AnnotatedTarget:
    mask = folder.first(f"{masks}{row.get('Mask name', '')}")
    box = None
    for column, order in BOX_COLUMNS.items():
        if column in row:
            box = numbers(row[column].strip("[]() ").replace(",", " ").split(), 4)[list(order)]
    posed = "Tx" in row
    x, y, z, w = cells_or_nan(row, QUATERNION)
    return AnnotatedTarget(
        id=label,
        rotation=np.array([w, x, y, z]) if posed else None,
        t_cam_body=cells_or_nan(row, POSITION) if posed else None,
        box=box,
        mask=MaskSource(file=mask) if mask else None,
    )


SPARK_SET = SetFormat(
    name="spark",
    recognises=_recognises,
    read=_read_set,
    fields=PoseFields(files=TABLE, rotation=QUATERNION, position=POSITION, name="filename", scalar_last=True),
)

"""SPARK: its three layouts for classification and detection, and the layout of stream 2 for poses of trajectories.

A row of stream 2, which CubeSat-CDT is assumed to share, has a file name, its sequence, t_cam_body in
metres and q_cam_body, scalar last. A file name is unique only in its sequence. Sources: the "SPARK utils" of the
challenges. 2021: SPLIT_rgb/CLASS, SPLIT_depth/CLASS and SPLIT_labels.csv; stream 1 of 2022: SPLIT and SPLIT.csv; of
2024: images/CLASS/SPLIT, mask/CLASS/SPLIT and SPLIT.csv; stream 2 of both: SPLIT.csv and SPLIT/images/GTnnn.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.errors import InputError
from spin_usd.exchange.layout.export_format import ExportFormat, FormatOption, IndexRow, Layout, MadeFile, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import JPEG, any_image, depth_image
from spin_usd.exchange.layout.index_file import IndexFile, csv_table
from spin_usd.exchange.layout.limits import depth_at_most, no_distortion, one_camera, target_is_a_file_name
from spin_usd.exchange.pose_format import SCALAR_LAST, PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import cells, csv_rows
from spin_usd.formats.image_file import write_image

BODY, PANEL = (255, 0, 0), (0, 0, 255)
PANEL_CLASS = "solar_panel"
WITHOUT_DEPTH = "leave depth out with --option depth=none"

BOXES = (
    "Boxes are tight around the target's visible pixels, in whole pixels from the image's corner; the greater numbers "
    "are one past the last row and column."
)
CLASS = "Class is the target's name. Pictures that show nothing of it are left out."
ROWS_FIRST = f"bbox is [Rmin, Cmin, Rmax, Cmax]: rows first. {BOXES}"
COLUMNS_FIRST = f"Bounding box is (xmin, ymin, xmax, ymax): columns first. {BOXES}"
LOADERS = (
    "The challenge's own names are kept. Some public loaders look for 'SPLIT labels.csv', SPLIT/CLASS/ and "
    "depth/CLASS/ instead of SPLIT_labels.csv, SPLIT_rgb/CLASS/ and SPLIT_depth/CLASS/: rename, or link, for those."
)
DEPTH = "Depth is planar z in whole millimetres, 16-bit PNG, 0 for nothing."
LAYERS = f"A mask is red for the body and blue for parts of the class {PANEL_CLASS}; black is nothing. {JPEG}."
POSITION = ("Tx", "Ty", "Tz")
QUATERNION = ("Qx", "Qy", "Qz", "Qw")
COLUMNS = ("filename", "sequence", *POSITION, *QUATERNION)
HEAD = ",".join(COLUMNS)
CONVENTIONS = (
    "p_cam = R(q) p_body + T: Qx, Qy, Qz, Qw is the unit quaternion, scalar last, Hamilton, of the rotation from the "
    "body's axes to the camera's; T is the body's origin in the camera's axes, in metres. Numbers have all "
    "their digits.",
    "Camera axes are OpenCV's: x right, y down, z forward. Body axes are the axes of the target's model.",
    "A sequence GTnnn is one variant of the dataset, in the order of its frames. Images are PNG, as the dataset's.",
    "The format has no camera file: K is in the table below.",
)


def rows_first(picture: ExportedPicture) -> str:
    """Return the box as SPARK 2021 and 2022 write it: rows, then columns."""
    x0, y0, x1, y1 = _box(picture)
    return f"[{y0}, {x0}, {y1}, {x1}]"


def columns_first(picture: ExportedPicture) -> str:
    """Return the box as SPARK 2024 writes it: columns, then rows."""
    x0, y0, x1, y1 = _box(picture)
    return f"({x0}, {y0}, {x1}, {y1})"


def _box(picture: ExportedPicture) -> list[int]:
    return [round(number) for number in picture.target.box_visible.tolist()]


def _detection(
    *,
    files: Callable[[ExportedDataset, ExportedPicture], Iterator[Output]],
    index: str,
    columns: Sequence[str],
    conventions: tuple[str, ...],
    validation: str,
    depth: bool = False,
) -> Layout:
    """Return a layout of boxes; `index` has {split} in the place of the split's name."""

    def indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
        return {index.format(split=split): csv_table(columns) for split in dataset.splits}

    return Layout(
        needs=("image", "segmentation", *(["depth"] if depth else [])),
        conventions=(*conventions, CLASS),
        indexes=indexes,
        files=files,
        limits=(target_is_a_file_name, *([depth_at_most(1, WITHOUT_DEPTH)] if depth else [])),
        splits={"train": "train", "validation": validation, "test": "test"},
        visible_only=True,
    )


def _files_2021(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    label, split, file = picture.target.name, picture.split, f"{picture.name}.png"
    yield any_image(picture, f"{split}_rgb/{label}/{file}")
    depth = ""
    if dataset.options["depth"] != "none":
        depth = f"{picture.name}_depth.png"
        yield depth_image(picture, f"{split}_depth/{label}/{depth}")
    yield IndexRow(path=f"{split}_labels.csv", value=(file, depth, label, rows_first(picture)))


def _files_2022(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    label, split, file = picture.target.name, picture.split, f"{picture.name}.png"
    yield any_image(picture, f"{split}/{file}")
    yield IndexRow(path=f"{split}.csv", value=(file, label, rows_first(picture)))


def _files_2024(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    label, split = picture.target.name, picture.split
    image, mask = f"{picture.name}_img.jpg", f"{picture.name}_layer.jpg"
    yield any_image(picture, f"images/{label}/{split}/{image}")
    yield MadeFile(path=f"mask/{label}/{split}/{mask}", write=partial(_write_layers, picture))
    yield IndexRow(path=f"{split}.csv", value=(label, image, mask, columns_first(picture)))


def _write_layers(picture: ExportedPicture, path: Path) -> None:
    """Write the mask: each part id has its class's colour, unless it is another target's."""
    colours = np.zeros((max(picture.parts, default=0) + 1, 3), np.uint8)
    for number, part in picture.parts.items():
        colours[number] = PANEL if part.class_name == PANEL_CLASS else BODY
    layers = colours[picture.label("segmentation")] * picture.mask()[..., None]
    write_image(path, layers, channels=("R", "G", "B"))


def pose_table_layout(*, notes: tuple[str, ...] = ()) -> Layout:
    """Return the layout of stream 2, a sequence for each variant; `notes` are further sentences for the card."""
    return Layout(
        needs=("image",),
        conventions=(*CONVENTIONS, *notes),
        indexes=_indexes_stream2,
        files=_files_stream2,
        limits=(no_distortion, one_camera),
        splits={"train": "train", "validation": "val", "test": "test"},
    )


def _indexes_stream2(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {f"{split}.csv": csv_table(COLUMNS) for split in dataset.splits}


def _files_stream2(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    sequence = f"GT{dataset.variants.index(picture.variant) + 1:03}"
    filename = f"{picture.name}.png"
    yield any_image(picture, f"{picture.split}/images/{sequence}/{filename}")
    w, x, y, z = picture.target.q_cam_body.tolist()
    row = (filename, sequence, *picture.target.t_cam_body.tolist(), x, y, z, w)
    yield IndexRow(path=f"{picture.split}.csv", value=row)


def layout(options: Mapping[str, Any]) -> Layout:
    """Return the layout that the option "layout" names."""
    depth = options["depth"] != "none"
    match options["layout"]:
        case "2021":
            return _detection(
                files=_files_2021,
                index="{split}_labels.csv",
                columns=("image", "depth", "class", "bbox"),
                conventions=(ROWS_FIRST, *([DEPTH] if depth else []), LOADERS),
                validation="validate",
                depth=depth,
            )
        case "2022-stream1":
            columns = ("filename", "class", "bbox")
            conventions = (ROWS_FIRST,)
            return _detection(
                files=_files_2022, index="{split}.csv", columns=columns, conventions=conventions, validation="val"
            )
        case "2024-stream1":
            return _detection(
                files=_files_2024,
                index="{split}.csv",
                columns=("Class", "Image name", "Mask name", "Bounding box"),
                conventions=(COLUMNS_FIRST, LAYERS),
                validation="val",
            )
        case _:
            return pose_table_layout()


ASSUMED = "The layout is assumed to be SPARK's stream 2, from the same laboratory; CubeSat-CDT's own is not published."
CUBESAT_CDT = ExportFormat(
    name="cubesat_cdt",
    holds="in an assumed layout of CubeSat-CDT: the poses of trajectories as CSV",
    layout=pose_table_layout(notes=(ASSUMED,)),
)
SPARK = ExportFormat(
    name="spark",
    holds="in a layout of SPARK: the poses of trajectories as CSV, or boxes and masks",
    layout=layout,
    options=(
        FormatOption(
            name="layout",
            meaning="the challenge and its stream",
            default="stream2",
            choices=("2021", "2022-stream1", "2024-stream1", "stream2"),
        ),
        FormatOption(
            name="depth", meaning="depth images, in 2021 alone", default="millimetres", choices=("millimetres", "none")
        ),
    ),
)


def read_poses(path: Path) -> Iterator[PoseEntry]:
    """Read the rows of the file. Raises InputError that names the row."""
    rows = list(csv_rows(path))
    names = [row.get("filename", "") for _, _, row in rows]
    repeated = len(set(names)) < len(names)
    for (line, where, row), name in zip(rows, names, strict=True):
        if not name:
            raise InputError("has no filename", where=where, do=f"give {HEAD}")
        x, y, z, w = cells(row, QUATERNION, where)
        filename = f"{row.get('sequence', '')}_{name}" if repeated else name
        t = cells(row, POSITION, where)
        yield PoseEntry(filename=filename, q_cam_body=(w, x, y, z), t_cam_body=t, line=line)


SPARK_POSES = PoseFormat(
    name="SPARK's stream 2",
    recognises=lambda path, head: head.replace(" ", "").startswith(HEAD),
    read=read_poses,
    lists=files_like("*.csv", "*/*.csv"),
    rotation=SCALAR_LAST,
)

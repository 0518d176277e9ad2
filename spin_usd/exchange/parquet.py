"""Parquet as Hugging Face's datasets reads it: images in the table, a row a picture, and a card that names the shards.

A picture's target is q_cam_body, scalar first, and t_cam_body in metres; these are read again. An image is a struct of
its file's bytes and its name. Sources: the documentation of `datasets` (features, "Image feature") and of the hub
(dataset cards, "Data files configuration"), and `datasets/features/features.py` for the expected metadata of a table.
pyarrow is an extra.
"""

import json
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.extras import EXTRAS
from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.exchange.layout.export_format import ExportFormat, FormatOption, Layout, MadeFile, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import depth_numbers, eight_bits
from spin_usd.exchange.layout.limits import depth_at_most, needs_extra, no_fisheye, same_files
from spin_usd.exchange.layout.shards import PICTURES, ExportShard, shard_with, shards_of
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import finite_numbers
from spin_usd.files.size_limits import MAX_SHARD
from spin_usd.files.user_file import open_file
from spin_usd.formats.image_file import encoded_image
from spin_usd.reading.pictured_target import PicturedTarget

if TYPE_CHECKING:
    import pyarrow

IMAGE, DEPTH, MILLIMETRES = "image", "depth", "millimetres"
ROWS = 100  # of a group: a reader takes a group into memory at a time, with its images
WITHOUT_DEPTH = "export without depth: --option depth=none"
POSE = ("q_cam_body", "t_cam_body")
TARGET = {
    "id": "int64",
    "name": "string",
    "q_cam_body": ["float64"],
    "t_cam_body": ["float64"],
    "visible_fraction": "float64",
    "box_visible": ["float64"],
    "box_amodal": ["float64"],
    "keypoints": [["float64"]],
    "keypoint_states": ["string"],
}
BEFORE = {"name": "string", "frame": "string", "variant": "string", "index": "int64"}
AFTER = {
    "width": "int64",
    "height": "int64",
    "K": [["float64"]],
    "distortion": ["float64"],
    "q_cam_body": ["float64"],
    "t_cam_body": ["float64"],
    "targets": [TARGET],
}
"""Types of columns: a name of Arrow's, "image", a list of one type, or the members of a struct."""
CONVENTIONS = (
    "p_cam = R(q) p_body + t: q_cam_body is a unit quaternion, scalar first, Hamilton; t_cam_body is in metres. Camera "
    "axes are OpenCV's: x right, y down, z forward. Body axes are those of the target's model.",
    "K and all pixels have (0, 0) at the corner of the image; distortion is k1, k2, p1, p2, k3 of OpenCV.",
    "A row's own pose is the pose of the target that this card names. Its targets are all, visible or not: boxes are "
    "x0, y0, x1, y1, the last two past the last pixel; box_amodal ignores occlusion; keypoints are u, v. Missing "
    "values are null.",
    "image has 8 bits. segmentation has the ids of parts, 0 for nothing, in 16 bits, like the dataset's file; other "
    "PNG labels are included, except 16-bit colour ones, which Pillow reads as 8-bit.",
)
IN_MILLIMETRES = "depth is planar z in whole millimetres, 16 bits, 0 for nothing."


def columns_of(dataset: ExportedDataset) -> dict[str, Any]:
    """Return the types of the columns by their names: with all labels that Pillow reads whole, as all pictures have
    them; of PNG in colour it reads 8 bits alone."""
    files = dataset.picture(0).picture.files.items()
    labels = [
        kind for kind, file in files if file.path.endswith(".png") and (file.channels, file.dtype) != (3, "uint16")
    ]
    kinds = dict.fromkeys([IMAGE, *labels])
    depth = [DEPTH] if dataset.options[DEPTH] == MILLIMETRES else []
    return BEFORE | dict.fromkeys([*kinds, *depth], IMAGE) | AFTER


def arrow_type(column: Any) -> "pyarrow.DataType":
    """Return the type of a column in Arrow."""
    import pyarrow as pa

    if isinstance(column, list):
        return pa.list_(arrow_type(column[0]))
    if isinstance(column, dict):
        return pa.struct([pa.field(name, arrow_type(each)) for name, each in column.items()])
    if column == IMAGE:
        return pa.struct([pa.field("bytes", pa.binary()), pa.field("path", pa.string())])
    return getattr(pa, column)()


def feature(column: Any) -> Any:
    """Return the type of a column as `datasets` has it in a table's metadata; before version 4 it called a list a
    Sequence, which later ones understand, and wrote one of structs as a list."""
    if isinstance(column, list):
        inner = feature(column[0])
        return [inner] if isinstance(column[0], dict) else {"feature": inner, "_type": "Sequence"}
    if isinstance(column, dict):
        return {name: feature(each) for name, each in column.items()}
    return {"_type": "Image"} if column == IMAGE else {"dtype": column, "_type": "Value"}


def card_feature(column: Any) -> dict[str, Any]:
    """Return the type of a column as it stands in a card's YAML."""
    if isinstance(column, list):
        inner = card_feature(column[0])
        return {"list": inner.get("dtype", inner.get("struct", inner))}
    if isinstance(column, dict):
        return {"struct": [{"name": name, **card_feature(each)} for name, each in column.items()]}
    return {"dtype": column}


def _card_head(dataset: ExportedDataset) -> str:
    """Return the card's YAML; each line's value is JSON, which is YAML too."""
    files = [{"split": split, "path": f"data/{split}-*.parquet"} for split in dataset.splits]
    features = [{"name": name, **card_feature(column)} for name, column in columns_of(dataset).items()]
    head = {
        "pretty_name": f"{dataset.target}, synthetic pictures",
        "configs": [{"config_name": "default", "data_files": files}],
        "dataset_info": {"features": features},
    }
    return "---\n" + "".join(f"{name}: {json.dumps(value)}\n" for name, value in head.items()) + "---\n\n"


def _name(shard: ExportShard) -> str:
    return f"data/{shard.split}-{shard.place:05d}-of-{shard.of:05d}.parquet"


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    """Yield the shard that the picture is the last of, if it is."""
    if shard := shards_of(dataset).get(picture.number):
        yield MadeFile(path=_name(shard), write=partial(_write_shard, dataset, shard.numbers))


def _write_shard(dataset: ExportedDataset, numbers: list[int], path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = columns_of(dataset)
    said = json.dumps({"info": {"features": {name: feature(column) for name, column in columns.items()}}})
    schema = pa.schema([pa.field(name, arrow_type(column)) for name, column in columns.items()])
    schema = schema.with_metadata({"huggingface": said})
    with pq.ParquetWriter(path, schema) as writer:
        for start in range(0, len(numbers), ROWS):
            rows = [_row(dataset.picture(number), columns) for number in numbers[start : start + ROWS]]
            writer.write_table(pa.Table.from_pylist(rows, schema))


def _row(picture: ExportedPicture, columns: Mapping[str, Any]) -> dict[str, Any]:
    camera, target = picture.camera, picture.target
    images = {kind: _image(picture, kind) for kind, column in columns.items() if column == IMAGE}
    return images | {
        "name": picture.name,
        "frame": picture.picture.frame,
        "variant": picture.variant,
        "index": picture.picture.index,
        "width": camera.width,
        "height": camera.height,
        "K": camera.matrix.tolist(),
        "distortion": list(camera.distortion),
        "q_cam_body": target.q_cam_body.tolist(),
        "t_cam_body": target.t_cam_body.tolist(),
        "targets": [_target(each) for each in picture.targets],
    }


def _image(picture: ExportedPicture, kind: str) -> dict[str, Any]:
    """Return the bytes of an image file, and its name: the dataset's own, but for depth, and for an image of 16 bits,
    which Pillow does not read in colour."""
    name = f"{picture.name}.png"
    if kind == DEPTH:
        millimetres = depth_numbers(picture.label(DEPTH), 1.0, picture.name)
        return {"bytes": encoded_image(millimetres, ".png", channels=("Y",)), "path": name}
    file = picture.picture.files[kind]
    if kind == IMAGE and file.dtype != "uint8":
        image = eight_bits(picture.image)
        channels = ("Y",) if image.ndim == 2 else ("R", "G", "B")
        return {"bytes": encoded_image(image, ".png", channels=channels), "path": name}
    with picture.file(kind).open() as opened:
        return {"bytes": opened.read(), "path": f"{picture.name}{Path(file.path).suffix}"}


def _target(target: PicturedTarget) -> dict[str, Any]:
    return {
        "id": target.id,
        "name": target.name,
        "q_cam_body": target.q_cam_body.tolist(),
        "t_cam_body": target.t_cam_body.tolist(),
        "visible_fraction": _known(np.asarray(target.visible_fraction)),
        "box_visible": _known(target.box_visible),
        "box_amodal": _known(target.box_amodal),
        "keypoints": [_known(each) for each in target.keypoints],
        "keypoint_states": list(target.keypoint_states),
    }


def _known(values: Float) -> Any:
    """Return the numbers, or None if missing."""
    return None if np.isnan(values).any() else values.tolist()


def _layout(options: Mapping[str, Any]) -> Layout:
    depth = options[DEPTH] == MILLIMETRES
    return Layout(
        needs=(IMAGE, "segmentation", *([DEPTH] if depth else [])),
        conventions=CONVENTIONS + ((IN_MILLIMETRES,) if depth else ()),
        files=_files,
        file=lambda dataset, picture: _name(shard_with(dataset, picture)),
        card_head=_card_head,
        limits=(needs_extra("parquet"), no_fisheye, same_files, *((depth_at_most(1, WITHOUT_DEPTH),) if depth else ())),
        several=True,
    )


PARQUET = ExportFormat(
    name="parquet",
    holds="as tables of Parquet with their images, for Hugging Face's datasets",
    layout=_layout,
    options=(
        PICTURES,
        FormatOption(name=DEPTH, meaning="depth images", default="none", choices=("none", MILLIMETRES)),
    ),
)


def read_poses(path: Path) -> Iterator[PoseEntry]:
    """Read the rows of the file. Raises InputError that names the row, and where pyarrow is not installed."""
    EXTRAS["parquet"].require(path)
    for number, row in enumerate(_rows(path)):
        where = f"{path}, row {number}"
        q, t = (finite_numbers(row[name], count, name, where) for name, count in zip(POSE, (4, 3), strict=True))
        if not isinstance(row["name"], str):
            raise InputError("name is not text", where=where, do="give the picture's name")
        yield PoseEntry(filename=row["name"], q_cam_body=q, t_cam_body=t)


def _rows(path: Path) -> Iterator[dict[str, Any]]:
    """Yield the rows' names and poses. Raises InputError."""
    import pyarrow.parquet as pq

    wanted = ["name", *POSE]
    with decoding(path), open_file(path, MAX_SHARD) as file, pq.ParquetFile(file) as table:
        for name in wanted:
            if name not in table.schema_arrow.names:
                raise InputError(f"has no column {name!r}", where=path, do=f"give {', '.join(wanted)}")
        for batch in table.iter_batches(columns=wanted):
            yield from batch.to_pylist()


PARQUET_POSES = PoseFormat(
    name="Parquet",
    recognises=lambda path, head: path.suffix.lower() == ".parquet",
    read=read_poses,
    lists=files_like("*.parquet", "*/*.parquet"),
)

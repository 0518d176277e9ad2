"""WebDataset: shards, which are tar files of pictures one after another, and an index of them for each split.

Source: the description of the format in webdataset's documentation: the files of one sample follow each other, and have
the same name up to the first dot. Its library `wids` reads the index. Hugging Face's `datasets` takes each KEY.json as
a row of one table, whose types it learns from the first five: every value has one type, and none is null. We read poses
from KEY.json, either such a row or a record of spin_usd.
"""

import json
import tarfile
from collections.abc import Iterator, Mapping
from functools import partial
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import decoding
from spin_usd.basics.nesting import parsed_json
from spin_usd.errors import InputError
from spin_usd.exchange.layout.export_format import ExportFormat, IndexRow, Layout, MadeFile, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.index_file import IndexFile, json_lists
from spin_usd.exchange.layout.limits import no_fisheye
from spin_usd.exchange.layout.shards import PICTURES, ExportShard, shard_with, shards_of
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.record_poses import pose_of_record
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.size_limits import MAX_RECORD, MAX_SHARD
from spin_usd.files.user_file import open_file
from spin_usd.formats.tar_file import Member, write_tar
from spin_usd.reading.pictured_target import PicturedTarget
from spin_usd.store.names import record_of

SHARDS = "shardlist"
DOT = "%2E"  # "%" is in no name, so no two names become one
ROW = ".json"  # the ending of a sample's table
CONVENTIONS = (
    "Each sample has the files of one picture as the dataset has them, KEY.KIND.SUFFIX, such as img000001.depth.exr, "
    "its record, KEY.record.txt, which is JSON, and of that KEY.json: names, camera and targets as tables of one type, "
    "for readers that want the same types in all samples.",
    "KEY.json differs from the record: a target's `keypoints` are only [u, v], and their words are "
    "`keypoint_states`; where the record has null, it has 0: boxes of invisible targets, points outside the lens's "
    "view.",
    "All conventions are the dataset's: pixels with (0, 0) at the corner of the image, metres, quaternions scalar "
    "first, the camera's axes x right, y down, z forward.",
    "A dot in a picture's name is written %2E in its key, for a key ends at the first dot.",
)


def key_of(name: str) -> str:
    """Return the sample's key for the picture of that name: without dots."""
    return name.replace(".", DOT)


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {f"{split}.json": json_lists({"wids_version": 1, "name": split}, [SHARDS]) for split in dataset.splits}


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    """Yield the shard that the picture is the last of, if it is."""
    if shard := shards_of(dataset).get(picture.number):
        name = _name(shard)
        yield MadeFile(path=name, write=partial(_write_shard, dataset, shard.numbers))
        row = {"url": name, "nsamples": len(shard.numbers)}
        yield IndexRow(path=f"{picture.split}.json", section=SHARDS, value=row)


def _name(shard: ExportShard) -> str:
    return f"{shard.split}-{shard.place:06d}.tar"


def _shard_of(dataset: ExportedDataset, picture: ExportedPicture) -> str:
    return _name(shard_with(dataset, picture))


def _write_shard(dataset: ExportedDataset, numbers: list[int], path: Path) -> None:
    write_tar(path, (member for number in numbers for member in _members(dataset.picture(number))))


def _members(picture: ExportedPicture) -> Iterator[Member]:
    """Yield the picture's files in the order of their kinds, then its record, then its row of a table."""
    key = key_of(picture.name)
    for kind in sorted(picture.picture.files):
        source = picture.file(kind)
        yield Member(name=f"{key}.{kind}{source.path.suffix}", source=source)
    record = record_of(picture.variant, picture.picture.frame)
    yield Member(name=f"{key}.record.txt", source=FileIn(Folder(picture.picture.root), record))
    yield Member(name=f"{key}{ROW}", source=json.dumps(_row(picture), allow_nan=False).encode())


def _row(picture: ExportedPicture) -> dict[str, Any]:
    """Return the common fields of every record, each number with one type in all pictures."""
    camera = picture.camera
    lens = {name: float(getattr(camera, name)) for name in ("fx", "fy", "cx", "cy")}
    return {
        "frame": picture.picture.frame,
        "index": picture.picture.index,
        "variant": picture.variant,
        "camera": {
            "width": camera.width,
            "height": camera.height,
            **lens,
            "distortion": [float(each) for each in camera.distortion],
        },
        "pose": {"q_cam_body": picture.picture.q_cam_body.tolist(), "t_cam_body": picture.picture.t_cam_body.tolist()},
        "targets": [_target_row(target) for target in picture.targets],
    }


def _target_row(target: PicturedTarget) -> dict[str, Any]:
    return {
        "id": target.id,
        "name": target.name,
        "pose": {"q_cam_body": target.q_cam_body.tolist(), "t_cam_body": target.t_cam_body.tolist()},
        "range": float(target.range),
        "pixels": {"visible": target.pixels_visible, "amodal": target.pixels_amodal},
        "visible_fraction": _numbers(target.visible_fraction),
        "box": {
            "visible": [int(each) for each in _numbers(target.box_visible)],
            "amodal": _numbers(target.box_amodal),
            "truncated": target.truncated,
        },
        "box_3d": {"box": target.box.tolist(), "corners": _numbers(target.box_3d)},
        "keypoints": _numbers(target.keypoints),
        "keypoint_states": list(target.keypoint_states),
    }


def _numbers(values: Float | float) -> Any:
    """Return the values as lists of numbers, 0 for missing ones."""
    return np.where(np.isnan(values), 0.0, values).tolist()


def _layout(options: Mapping[str, Any]) -> Layout:
    return Layout(
        needs=(),
        conventions=CONVENTIONS,
        files=_files,
        file=_shard_of,
        indexes=_indexes,
        limits=(no_fisheye,),
        several=True,
    )


WEBDATASET = ExportFormat(
    name="webdataset",
    holds="all files and records in tar shards, with an index",
    layout=_layout,
    options=(PICTURES,),
)


SUFFIXES = (".tar", ".tgz", ".tbz2", ".txz", ".tar.gz", ".tar.bz2", ".tar.xz")


def read_poses(path: Path) -> Iterator[PoseEntry]:
    """Read the records of the shard, and the shard to its end. Raises InputError that names the member."""
    with decoding(path), open_file(path, MAX_SHARD) as shard, _opened(shard, path) as tar:
        for member in tar:
            key, dot, kind = member.name.rpartition("/")[2].partition(".")
            if member.isfile() and dot + kind == ROW:
                file, where = tar.extractfile(member), f"{path}, {member.name[:200]}"
                text = file.read(MAX_RECORD) if file else b""
                yield pose_of_record(_parsed(text, where), where, name=key.replace(DOT, "."))
        _read_to_end(tar, path)


def _opened(shard: BufferedReader, path: Path) -> tarfile.TarFile:
    with decoding(path):
        try:
            return tarfile.open(fileobj=shard)
        except tarfile.ReadError:  # one line for each kind of compression
            raise InputError("is not a tar file", where=path, do="export it again") from None


def _read_to_end(tar: tarfile.TarFile, path: Path) -> None:
    """Raise InputError if no block of zeros follows the last member: `tarfile` accepts anything as the end. Raises
    EOFError if compressed data ends early."""
    file = tar.fileobj
    assert file is not None
    file.seek(tar.offset)
    if file.read(tarfile.BLOCKSIZE) != tarfile.NUL * tarfile.BLOCKSIZE:
        raise InputError("is not a whole tar file", where=path, do="export it again")
    file.seek(MAX_SHARD)  # for compressed data, this reads all


def _parsed(text: bytes, where: str) -> object:
    try:
        return parsed_json(text)
    except ValueError:
        raise InputError("is not JSON", where=where) from None


WEBDATASET_POSES = PoseFormat(
    name="WebDataset",
    recognises=lambda path, head: path.name.lower().endswith(SUFFIXES),
    read=read_poses,
    lists=files_like("*.tar", "*/*.tar"),
)

"""The records of a dataset, each valid by its schema; and records for tests that look at a part of them."""

import json
from pathlib import Path
from typing import Any

from spin_usd.records.record import RECORDED_KEYS, Record
from spin_usd.store.json_schema import valid
from spin_usd.store.read_documents import decoded_record

EFFORT = {"samples": 1, "adaptive": 0, "denoiser": "none", "bounces": 0, "clamp": 0, "light_tree": True, "reduction": 1}
PROVENANCE = {
    "stage": {"root": "stage/dataset.usda", "hash": "0" * 64, "files": {}, "variants": {}},
    "keys": dict.fromkeys(RECORDED_KEYS, "0" * 64),
    "render": {"renderer": "raycast", "effort": EFFORT, "region": [0, 0, 1, 1]},
    "time_code": 0,
    "seed": {"dataset": 0, "render": 0, "picture": 0},
    "versions": {},
}
FILE = {"path": "depth/nominal/frame.exr", "sha256": "0" * 64, "dtype": "float32", "channels": {"Y": "depth"}}
POSE = {"q_cam_body": [1, 0, 0, 0], "t_cam_body": [0, 0, 5]}
TARGET = {
    "id": 1,
    "name": "T",
    "pose": POSE,
    "range": 5,
    "pixels": {"visible": 0, "amodal": 0},
    "visible_fraction": None,
    "box": {"visible": None, "amodal": None, "truncated": True},
    "box_3d": {"box": [[0, 0, 0], [1, 1, 1]], "corners": [None] * 8},
    "keypoints": [],
}


def record_at(path: Path) -> dict[str, Any]:
    """The record in the file at `path`."""
    return valid(path.read_bytes(), "record-1", path)


def record_files(dataset: Path) -> list[Path]:
    """The records' files, ordered by variant and frame."""
    return sorted(dataset.glob("records/*/*.json"))


def records_of(dataset: Path) -> list[dict[str, Any]]:
    """All records, in that order."""
    return list(map(record_at, record_files(dataset)))


def record_saying(**said) -> Record:
    """A record as it is read from its file, with these parts; what else it has stands for itself."""
    rest = {
        "schema": "record-1",
        "frame": "frame",
        "index": 0,
        "variant": "nominal",
        "camera": {"width": 8, "height": 8, "fx": 8, "fy": 8, "cx": 4, "cy": 4, "distortion": [0] * 5},
        "pose": POSE,
        "targets": [TARGET],
        "files": {"depth": FILE},
        "provenance": PROVENANCE,
    }
    return decoded_record(json.dumps({**rest, **said}).encode(), Path("records/nominal/frame.json"))

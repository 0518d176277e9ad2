"""Datasets for exports: cloned from a few rendered pictures, with other names, poses and cameras in their records."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from spin_usd.basics.progress import no_progress
from spin_usd.commands.export.in_child import export_dataset
from spin_usd.commands.export.options import ExportOptions
from spin_usd.formats.image_file import read_image, write_image

PLAIN = {"fx": 640.0, "fy": 640.0, "cx": 120.0, "cy": 75.0, "distortion": [0.0] * 5}
"""A camera without distortion, of the rendered pictures' size."""


@pytest.fixture(scope="session")
def rendered(rendered_tango):
    """Three pictures of Tango, whose parts and keypoints are of all kinds, in place of the CubeSat's."""
    return rendered_tango


def clone(source: Path, folder: Path, pictures) -> Path:
    """Make a dataset in `folder` of `pictures`: dicts with "frame", and where they differ from a rendered picture
    "variant", "index", "time", "q", "t", "camera" (members that change) and "kinds" (those that it has)."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(source / "dataset.json", folder)
    records = [json.loads(path.read_text()) for path in sorted((source / "records" / "nominal").iterdir())]
    for place, wanted in enumerate(pictures):
        record = json.loads(json.dumps(records[place % len(records)]))
        rename(source, folder, record, wanted)
        place_in_stage(record, wanted, place)
        path = folder / "records" / record["variant"] / f"{record['frame']}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(record))
    return folder


def rename(source, folder, record, wanted) -> None:
    """Give the record its name, and its files too."""
    record |= {"frame": wanted["frame"], "variant": wanted.get("variant", "nominal")}
    kinds = wanted.get("kinds", tuple(record["files"]))
    record["files"] = {kind: record["files"][kind] for kind in kinds}
    for kind, file in record["files"].items():
        old = source / file["path"]
        file["path"] = f"{kind}/{record['variant']}/{record['frame']}{old.suffix}"
        new = folder / file["path"]
        new.parent.mkdir(parents=True, exist_ok=True)
        os.link(old, new)


def place_in_stage(record, wanted, place) -> None:
    """Give the record its index, its pose and its camera."""
    record["index"] = wanted.get("index", place)
    if "time" in wanted:
        record["time_s"] = wanted["time"]
    record["camera"] |= wanted.get("camera", {})
    poses = [record["pose"], *(target["pose"] for target in record.get("targets", [])[:1])]
    for pose in poses:
        pose["q_cam_body"] = wanted.get("q", pose["q_cam_body"])
        pose["t_cam_body"] = wanted.get("t", pose["t_cam_body"])


def write_export(dataset, to, out, **asked):
    """Export without progress; `asked` as ExportOptions has it."""
    asked |= {"option": [f"{name}={value}" for name, value in asked.pop("options", {}).items()]}
    return export_dataset(ExportOptions(dataset, to=to, out=out, **asked), progress=no_progress)


def contents(folder: Path) -> dict[str, bytes]:
    """The bytes of all files in the folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def two_variants(rendered, tmp_path_factory):
    """Six frames of two variants, as rendered (with distortion)."""
    frames = [f"img{number:06}" for number in range(1, 7)]
    pictures = [
        {"frame": frame, "variant": variant, "index": index, "t": [0.1, 0.2, 5.0 + index]}
        for variant in ("nominal", "noisy_1")
        for index, frame in enumerate(frames)
    ]
    return clone(rendered, tmp_path_factory.mktemp("two") / "dataset", pictures)


@pytest.fixture(scope="module")
def plain(rendered, tmp_path_factory):
    """Three frames of a camera without distortion."""
    pictures = [{"frame": f"img{number:06}", "camera": PLAIN} for number in range(1, 4)]
    return clone(rendered, tmp_path_factory.mktemp("plain") / "dataset", pictures)


@pytest.fixture(scope="module")
def blanked(rendered, tmp_path_factory):
    """Two pictures, of which "a" shows nothing of the target, in its label and in its record."""
    pictures = [{"frame": "a", "camera": PLAIN}, {"frame": "b", "camera": PLAIN}]
    dataset = clone(rendered, tmp_path_factory.mktemp("blanked") / "dataset", pictures)
    blank(dataset, "a")
    return dataset


def blank(dataset, frame) -> None:
    """Make a picture show nothing of the target."""
    file = dataset / "segmentation" / "nominal" / f"{frame}.png"
    ids, _ = read_image(file)
    file.unlink()  # another dataset has it too
    write_image(file, np.zeros_like(ids), channels=("Y",))
    path = dataset / "records" / "nominal" / f"{frame}.json"
    record = json.loads(path.read_text())
    for target in record.get("targets", []):
        target["pixels"]["visible"], target["visible_fraction"], target["box"]["visible"] = 0, 0.0, None
    path.write_text(json.dumps(record))

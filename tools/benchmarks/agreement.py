"""How far labels of one picture agree with one another, by the rules of `check`, and what the targets' facts cost.

A stage of sampled poses is rendered without light, or a dataset that is there is read.
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.command import asked

from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.checked_target import CheckedTarget, targets_of
from spin_usd.commands.check.in_child.keypoints import depths_around
from spin_usd.commands.check.in_child.picture import box_of_mask, pose_error
from spin_usd.files.folder import FileIn
from spin_usd.formats.array_file import read_array
from spin_usd.records.descriptions import DatasetDescription
from spin_usd.store.dataset_folder import Store
from spin_usd.store.description import read_dataset_json
from spin_usd.store.read_record import read_record

POSES = "range=3..10 attitude=uniform inside=0.8"
NUMBERS = {
    "degrees": "pose from the dense pose, degrees from the record's",
    "millimetres": "pose from the dense pose, mm from the record's",
    "amodal_px": "amodal box beside the visible one, px, where nothing is cut off or hidden",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--dataset", type=Path, help="one that is there")
    parser.add_argument("--sample", default=POSES, help="poses, as of spin-usd author")
    parser.add_argument("--count", type=int, default=100, help="pictures")
    parser.add_argument("--target", default="tango")
    parser.add_argument("--camera", default="speedplus")
    parser.add_argument("--renderer", default="raycast")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.count = 2
    if options.dataset:
        return of_dataset(options.dataset)
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as folder:
        stage, dataset = Path(folder) / "stage", Path(folder) / "dataset"
        poses = ["--sample", options.sample, "--count", options.count]
        asked("author", *poses, "--target", options.target, "--camera", options.camera, "--out", stage)
        where = ["--out", dataset, "--renderer", options.renderer, "--workers", 1]
        report = asked("render", stage, *where, "--labels-only")
        return {**of_dataset(dataset), "facts_s": round(report["work"]["facts"] / report["made"], 4)}


def of_dataset(root: Path) -> dict[str, Any]:
    """Return the figures of all targets in all pictures."""
    store = Store(root=root.absolute())
    description = read_dataset_json(store.folder)
    found = [each for name in store.records() for each in of_picture(store, name, description)]
    figures: dict[str, Any] = {"targets": len(found)}
    for name in NUMBERS:
        values = [float(each[name]) for each in found if each.get(name) is not None]
        figures[name] = {"of": len(values), **{key: float(f"{v:.3g}") for key, v in exact(values).items()}}
    for name in ("boxes", "equal_boxes", "visible", "visible_beside", "hidden", "hidden_behind"):
        figures[name] = int(sum(each.get(name, 0) for each in found))
    return figures


def exact(values: list[float]) -> dict[str, float]:
    return {"median": float(np.median(values)), "most": max(values)} if values else {"median": np.nan, "most": np.nan}


def of_picture(store: Store, name: str, description: DatasetDescription) -> Iterator[dict[str, Any]]:
    """Yield the figures of each target in a picture."""
    record = read_record(store.folder, name)
    arrays = {kind: read_array(FileIn(store.folder, file.path)) for kind, file in record.files.items()}
    picture = CheckedPicture(where=name, record=record, description=description, arrays=arrays)
    for target in targets_of(picture):
        yield {**of_pose(target), **of_boxes(target), **of_keypoints(target)}


def of_pose(target: CheckedTarget) -> dict[str, Any]:
    error = pose_error(target)
    return {"degrees": error.degrees, "millimetres": 1000 * error.metres} if error else {}


def of_boxes(target: CheckedTarget) -> dict[str, Any]:
    box, pixels = target.recorded.box, target.recorded.pixels
    figures: dict[str, Any] = {"boxes": 1, "equal_boxes": box_of_mask(target) == box.visible}
    if box.visible and box.amodal and not box.truncated and pixels.visible == pixels.amodal:
        figures["amodal_px"] = float(np.abs(np.subtract(box.visible, box.amodal)).max())
    return figures


def of_keypoints(target: CheckedTarget) -> dict[str, int]:
    """Count the keypoints in the frame that are visible, and of these the ones as deep as a surface that is seen in the
    pixels around them; those that are hidden, and of these the ones not before all that is seen there."""
    states = [state for _, _, state in target.recorded.keypoints]
    around = [(states[i] == "visible", depth) for i, depth in depths_around(target)]
    return {
        "visible": sum(visible for visible, _ in around),
        "visible_beside": sum(visible and depth.beside for visible, depth in around),
        "hidden": sum(not visible for visible, _ in around),
        "hidden_behind": sum(not visible and depth.z > depth.near for visible, depth in around),
    }


def table(figures: dict[str, Any]) -> str:
    lines = ["| what | of | median | most |", "| --- | --- | --- | --- |"]
    for name, words in NUMBERS.items():
        found = figures[name]
        lines.append(f"| {words} | {found['of']} | {found['median']:.3g} | {found['most']:.3g} |")
    lines += ["", "| what | of | so many |", "| --- | --- | --- |"]
    for words, of, those in (
        ("visible boxes that are the masks'", "boxes", "equal_boxes"),
        ("visible keypoints as deep as the depth around them", "visible", "visible_beside"),
        ("hidden keypoints behind what the depth shows", "hidden", "hidden_behind"),
    ):
        lines.append(f"| {words} | {figures[of]} | {figures[those]} |")
    if "facts_s" in figures:
        lines += ["", f"Facts: {figures['facts_s']:.3g} s a picture."]
    return "\n".join(lines)

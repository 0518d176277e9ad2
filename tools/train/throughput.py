"""Measure how fast pictures come to a training step: `tools/train/throughput --help`.

A dataset, its export in the layout of SPEED+ and its webdataset shards (read by the library of that name) are read,
cropped and given heatmaps, by processes that make batches; alone, and with the network learning from them.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
import webdataset
from numpy.typing import NDArray
from torch import Tensor

import spin_usd
from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.processes.processors import machine
from train.baseline import HeatmapLesson
from train.fit import Batches, Training, learner, step
from train.heatmaps import taught
from train.pictures import PictureSet, PosedPicture, kept, read_set

LOADERS = (0, 1, 2)
SHARDS = 4  # processes share whole shards
WARM = 2  # batches before the clock starts: processes are up, files have been read once
Batch = tuple[Tensor, Tensor]


def exported(dataset: Path, to: str, out: Path, *options: str) -> Path:
    command = (sys.executable, "-m", "spin_usd.command_line", "export", str(dataset), "--to", to, "--out", str(out))
    flags = [word for option in options for word in ("--option", option)]
    subprocess.run([*command, *flags], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return out


def in_batches(pictures: PictureSet, training: Training, loaders: int) -> Iterable[Batch]:
    """Return batches of random pictures, each read from its file."""
    found: Iterable[Batch] = torch.utils.data.DataLoader(
        Batches(HeatmapLesson(pictures), training), batch_size=None, num_workers=loaders
    )
    return found


def from_shards(shards: list[str], points: Float, training: Training, loaders: int) -> Iterable[Batch]:
    """Return batches of pictures in the shards' order, again and again."""
    stream = webdataset.WebDataset(shards, shardshuffle=False, empty_check=False).map(partial(made, points, training))
    batches = stream.batched(training.batch, collation_fn=_stacked, partial=False).repeat()
    found: Iterable[Batch] = torch.utils.data.DataLoader(batches, batch_size=None, num_workers=loaders)
    return found


def made(points: Float, training: Training, sample: dict[str, Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    row = json.loads(sample["json"])
    lens = {name: row["camera"][name] for name in ("width", "height", "fx", "fy", "cx", "cy")}
    T_cam_body = np.eye(4)
    T_cam_body[:3, :3] = matrices_from_quaternions(np.array([row["pose"]["q_cam_body"]]))[0]
    T_cam_body[:3, 3] = row["pose"]["t_cam_body"]
    picture = PosedPicture(
        name=sample["__key__"],
        camera=Camera(**lens, distortion=tuple(row["camera"]["distortion"])),
        T_cam_body=T_cam_body,
        image=lambda: np.asarray(
            cv2.imdecode(np.frombuffer(sample["image.png"], np.uint8), cv2.IMREAD_GRAYSCALE), np.uint8
        ),
    )
    return taught(picture, points, training.size, np.random.default_rng() if training.jitter else None)


def _stacked(samples: list[tuple[NDArray[Any], NDArray[Any]]]) -> tuple[NDArray[Any], NDArray[Any]]:
    crops, heatmaps = zip(*samples, strict=True)
    return np.stack(crops), np.stack(heatmaps)


def rate(batches: Iterable[Batch], steps: int, learn: Callable[[Tensor, Tensor], float] | None) -> float:
    """Return the pictures a second of that many batches, wall-clock; `learn` takes each."""
    coming: Iterator[Batch] = iter(batches)
    pictures, begun = 0, 0.0
    for number, (crops, heatmaps) in enumerate(islice(coming, WARM + steps)):
        if learn is not None:
            learn(crops, heatmaps)
        if number >= WARM:
            pictures += len(crops)
        elif number == WARM - 1:
            begun = time.perf_counter()
    return pictures / (time.perf_counter() - begun)


def measure(dataset: Path, training: Training, work: Path) -> dict[str, Any]:
    """Return pictures a second by source and number of loaders, alone ("read") and with training ("trained"), and of
    training on what is in memory ("in memory")."""
    own = read_set(dataset)
    points = work / "points.json"
    points.write_text(json.dumps(own.points.tolist()))
    folder = exported(dataset, "speedplus", work / "speedplus", "image=png", "masks=none")
    (poses,) = (folder / "synthetic").glob("*.json")
    a_shard = f"pictures={-(-len(own.pictures) // SHARDS)}"
    shards = sorted(map(str, exported(dataset, "webdataset", work / "webdataset", a_shard).glob("*.tar")))
    sources: dict[str, Callable[[int], Iterable[Batch]]] = {
        "dataset": partial(in_batches, own, training),
        "SPEED+ folder": partial(in_batches, read_set(poses, keypoints=points), training),
        "webdataset shards": partial(from_shards, shards, own.points, training),
    }
    learn = partial(step, *learner(len(own.points), training, "cpu"), HeatmapLesson(own), device="cpu")
    steps = training.steps - WARM
    found: dict[str, Any] = {"in memory": rate(in_batches(kept(own), training, 0), steps, learn)}
    for name, batches in sources.items():
        found[name] = {
            "read": [rate(batches(loaders), steps, None) for loaders in LOADERS],
            "trained": [rate(batches(loaders), steps, learn) for loaders in LOADERS],
        }
        print(f"{name}: {found[name]}", flush=True)
    camera = own.pictures[0].camera
    return {"pixels": [camera.width, camera.height], "pictures": len(own.pictures), "rates": found}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("datasets", type=Path, nargs="+", help="datasets' folders, with an image each picture")
    parser.add_argument("--steps", type=int, default=60, help="batches of each measurement")
    parser.add_argument("--batch", type=int, default=32)
    parser.add_argument("--size", type=int, default=128, help="of a crop, pixels")
    parser.add_argument("--width", type=int, default=16, help="of the network")
    parser.add_argument("--decoder", type=int, default=64, help="of the network")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures there")
    given = parser.parse_args()
    torch.set_num_threads(1)
    sizes = {name: getattr(given, name) for name in ("steps", "batch", "size", "width", "decoder")}
    found = []
    for dataset in given.datasets:
        with tempfile.TemporaryDirectory() as work:
            found.append(measure(dataset, Training(**sizes), Path(work)))
    figures = {
        "training": sizes,
        "sets": found,
        "versions": {"torch": torch.__version__, "spin_usd": spin_usd.__version__},
        "machine": machine(),
    }
    print(json.dumps(figures, indent=1))
    if given.json:
        given.json.write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()

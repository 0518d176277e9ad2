"""Train the baseline on a set of pictures, and predict the poses of others: `tools/train/baseline --help`.

The network sees the square around the target, as a detector would give it: here it is made of the true pose. It learns
heatmaps of the target's keypoints; EPnP within RANSAC makes poses of them.

Stopped and started again, it goes on, to the same weights. OUT/NAME.csv holds the poses predicted for each --test
NAME=PICTURES, as `spin-usd score` takes them; OUT/training.json the losses, settings, versions and processor seconds.
"""

import argparse
import csv
import json
import os
import platform
import time
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")  # without it CUDA's sums are not the same twice

import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from train.fit import Fit, Training, fit, predicted
from train.heatmaps import pose_of, taught
from train.pictures import PictureSet, kept, read_set, read_sets

HEADINGS = ("filename", "qw", "qx", "qy", "qz", "x", "y", "z")
RESULT = "training.json"
PUBLISHED = {"size": 256, "layers": 50, "width": 64, "decoder": 256, "batch": 48}


@dataclass(frozen=True, eq=False)
class HeatmapLesson:
    """The heatmaps of the keypoints of a set's pictures."""

    of: PictureSet

    @property
    def outputs(self) -> int:
        return len(self.of.points)

    def __len__(self) -> int:
        return len(self.of.pictures)

    def example(
        self, place: int, size: int, rng: np.random.Generator | None
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        return taught(self.of.pictures[place], self.of.points, size, rng)

    def loss(self, answers: Tensor, wanted: Tensor) -> Tensor:
        return nn.functional.mse_loss(answers, wanted)


def options(about: str | None) -> argparse.ArgumentParser:
    """Return the options of all that learn, with this description."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("train", type=Path, nargs="+", help="datasets' folders, packs, or DOMAIN/NAME.json of SPEED+")
    parser.add_argument("--out", type=Path, required=True, help="folder of the checkpoint and what is predicted")
    parser.add_argument("--test", action="append", default=[], metavar="NAME=PICTURES", help="again for each set")
    parser.add_argument("--published", action="store_true", help=f"the published sizes: {PUBLISHED}")
    for field in fields(Training):
        if field.name != "jitter":
            parser.add_argument(f"--{field.name}", type=type(field.default), metavar="N", help=f"not {field.default}")
    parser.add_argument("--no-jitter", action="store_true", help="boxes are those of the true pose")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu", metavar="NAME")
    parser.add_argument(
        "--threads", type=int, default=1, metavar="N", help="of the processor; other sums round otherwise"
    )
    parser.add_argument("--loaders", type=int, default=0, metavar="N", help="processes that make batches")
    parser.add_argument("--save-every", type=float, default=30, metavar="SECONDS", help="between checkpoints")
    return parser


def training_of(given: argparse.Namespace) -> Training:
    asked = {field.name: getattr(given, field.name, None) for field in fields(Training) if field.name != "jitter"}
    chosen = {name: value for name, value in asked.items() if value is not None}
    return Training(**((PUBLISHED if given.published else {}) | chosen), jitter=not given.no_jitter)


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--frames", metavar="A:B:STEP", help="some of the frames")
    parser.add_argument("--appearances", type=int, metavar="N", help="variants of each frame; all if not given")
    parser.add_argument("--keypoints", type=Path, metavar="FILE", help="JSON list of points, of a set that has none")
    given = parser.parse_args()
    training = training_of(given)
    torch.set_num_threads(given.threads)
    pictures = kept(
        read_sets(given.train, frames=given.frames, appearances=given.appearances, keypoints=given.keypoints)
    )
    print(f"training on {len(pictures.pictures)} pictures", flush=True)
    how = {"device": given.device, "loaders": given.loaders, "save_every_s": given.save_every}
    found = fit(HeatmapLesson(pictures), training, given.out, **how)
    for test in given.test:
        name, _, path = test.partition("=")
        of = read_set(Path(path), keypoints=given.keypoints)
        write_predictions(given.out / f"{name}.csv", found, of, training, given.device)
        print(f"{given.out / name}.csv: {len(of.pictures)} poses", flush=True)
    write_result(given.out / RESULT, found, training, len(pictures.pictures), given)


def write_predictions(path: Path, found: Fit, pictures: PictureSet, training: Training, device: str) -> None:
    crops = [taught(each, pictures.points, training.size, None)[0] for each in pictures.pictures]
    rows: list[tuple[str, ...]] = [HEADINGS]
    for each, heatmaps in zip(pictures.pictures, predicted(found.network, crops, device), strict=True):
        pose = np.concatenate(pose_of(heatmaps, each, pictures.points, training.size))
        rows.append((each.name, *map(repr, pose.tolist())))
    new = path.with_suffix(".new")
    with new.open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    os.replace(new, path)


def write_result(path: Path, found: Fit, training: Training, pictures: int, given: argparse.Namespace) -> None:
    result = {
        "pictures": pictures,
        "training": asdict(training),
        "losses": found.losses,
        "cpu_s": found.cpu_s,
        "versions": {"python": platform.python_version(), "torch": torch.__version__, "numpy": np.__version__},
        "device": torch.cuda.get_device_name(given.device) if given.device.startswith("cuda") else given.device,
        "threads": given.threads,
        "finished": time.strftime("%Y-%m-%d"),
    }
    new = path.with_suffix(".new")
    new.write_text(json.dumps(result, indent=1) + "\n")
    os.replace(new, path)


if __name__ == "__main__":
    main()

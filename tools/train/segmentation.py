"""Train a network to find the parts of craft by class, and try it on others: `tools/train/segmentation --help`.

The network, its steps and its crops are the baseline's, but for the box, which is around the target's mask. A crop is
brightened so that its brightest hundredth is nearly white. A test is a dataset, or a folder of datasets, each of
another craft; OUT/NAME.json holds the intersections over unions by class, of all its pixels, and 95 % bootstrap
intervals over its craft, or over its pictures where it has one dataset.
"""

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np

os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")  # without it CUDA's sums are not the same twice

import torch
from numpy.typing import NDArray
from torch import Tensor, nn

import spin_usd
from spin_usd.basics.arrays import Float
from spin_usd.craft.craft import KINDS
from train.baseline import RESULT, options, training_of, write_result
from train.fit import Fit, fit, predicted
from train.heatmaps import SHIFT, STRIDE, ZOOM
from train.pictures import MARGIN, Crop, datasets_in, grey

CLASSES = ("nothing", *dict.fromkeys(KINDS.values()))
FEWEST = 30  # pixels of the target: pictures with fewer are left out
BRIGHTEST, WHITE = 99, 230.0  # percentile of the crop, and where it is put
RARE = 1e-3  # share of pixels below which a class weighs no more
RESAMPLED, INTERVAL = 2000, (0.025, 0.975)

Classes = NDArray[np.uint8]


@dataclass(frozen=True, kw_only=True, eq=False)
class SegmentedPicture:
    """image, classes (H, W): places in CLASSES · group: the dataset or the picture that it is resampled with."""

    image: NDArray[np.uint8]
    classes: Classes
    group: str

    @cached_property
    def box(self) -> Crop:
        """The square around the target."""
        rows, columns = np.nonzero(self.classes)
        low, high = (np.array([f(columns), f(rows)]) for f in (np.min, np.max))
        side = max(8, round(float((high + 1 - low).max()) * MARGIN))
        x, y = np.rint((low + high + 1 - side) / 2).astype(int).tolist()
        return Crop(x=x, y=y, side=side)

    def crop(self, box: Crop, size: int) -> NDArray[np.uint8]:
        """Return (size, size) of the image, brightened."""
        seen = box.of_image(self.image, size)
        return np.asarray(np.clip(seen * (WHITE / max(np.percentile(seen, BRIGHTEST), 1)), 0, 255), np.uint8)


def read_pictures(folder: Path) -> list[SegmentedPicture]:
    """Return the pictures of the dataset, or of all datasets below the folder, in which the target is seen."""
    datasets = datasets_in(folder)
    return [each for place in datasets for each in _of_dataset(place, alone=len(datasets) == 1)]


def _of_dataset(folder: Path, *, alone: bool) -> Iterator[SegmentedPicture]:
    dataset = spin_usd.Dataset(folder)
    class_of = np.zeros(1 << 16, np.uint8)
    for number, part in dataset.parts.items():
        class_of[number] = CLASSES.index(part.class_name) if part.class_name in CLASSES else 1
    for picture in dataset:
        classes = class_of[picture.segmentation]
        if np.count_nonzero(classes) >= FEWEST:
            group = picture.frame if alone else folder.parent.name
            yield SegmentedPicture(image=grey(picture.image), classes=classes, group=group)


class SegmentationLesson:
    """The classes of the pixels of pictures, of which rare ones weigh more."""

    outputs = len(CLASSES)

    def __init__(self, pictures: Sequence[SegmentedPicture]) -> None:
        self.pictures = pictures
        counts = sum(np.bincount(each.classes.ravel(), minlength=len(CLASSES)) for each in pictures)
        shares = counts / np.sum(counts)
        self._weights = torch.tensor(
            np.where(shares > 0, 1 / np.sqrt(np.maximum(shares, RARE)), 0), dtype=torch.float32
        )

    def __len__(self) -> int:
        return len(self.pictures)

    def example(
        self, place: int, size: int, rng: np.random.Generator | None
    ) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
        picture = self.pictures[place]
        box = picture.box
        if rng is not None:
            across, down, zoom = rng.uniform(-1, 1, 3).tolist()
            box = box.moved(SHIFT * across, SHIFT * down, (1 + ZOOM) ** zoom)
        wanted = box.of_image(picture.classes, size // STRIDE, cv2.INTER_NEAREST_EXACT).astype(np.int64)
        return picture.crop(box, size), wanted

    def loss(self, answers: Tensor, wanted: Tensor) -> Tensor:
        return nn.functional.cross_entropy(answers, wanted, weight=self._weights.to(answers.device))


def confusions(found: Fit, pictures: Sequence[SegmentedPicture], size: int, device: str) -> NDArray[np.int64]:
    """Return how many pixels of the crops of each picture are of a class and are answered as one, (N, C, C)."""
    answers = predicted(found.network, [each.crop(each.box, size) for each in pictures], device)
    counts = []
    for picture, cells in zip(pictures, answers, strict=True):
        wide = nn.functional.interpolate(torch.from_numpy(cells)[None], size=(size, size), mode="bilinear")
        said = wide[0].argmax(0).numpy()
        truth = picture.box.of_image(picture.classes, size, cv2.INTER_NEAREST_EXACT)
        pairs = np.bincount((truth.astype(np.int64) * len(CLASSES) + said).ravel(), minlength=len(CLASSES) ** 2)
        counts.append(pairs.reshape(len(CLASSES), len(CLASSES)))
    return np.array(counts)


def unions(counts: NDArray[Any]) -> Float:
    """Return intersections over unions (..., C) of counts (..., C, C); NaN of a class that is in no picture."""
    both = np.diagonal(counts, axis1=-2, axis2=-1).astype(np.float64)
    there = counts.sum(-1)
    return np.asarray(np.divide(both, there + counts.sum(-2) - both, out=np.full(both.shape, np.nan), where=there > 0))


def scores(counts: NDArray[np.int64], groups: Sequence[str]) -> dict[str, Any]:
    """Return the intersection over union of each class and of their mean, but for nothing, with intervals: groups have
    the same weight."""
    names = sorted(set(groups))
    of_group = np.array([counts[[each == name for each in groups]].sum(0) for name in names], np.float64)
    of_group /= of_group.sum((1, 2), keepdims=True)
    drawn = np.random.default_rng(0).integers(len(names), size=(RESAMPLED, len(names)))
    whole, again = unions(of_group.sum(0))[1:], unions(of_group[drawn].sum(1))[:, 1:]
    rows = {name: (whole[i], again[:, i]) for i, name in enumerate(CLASSES[1:])}
    rows["mean"] = np.nanmean(whole), np.nanmean(again, axis=1)
    return {
        "pictures": len(counts),
        "craft": len(names),
        "iou": {name: None if np.isnan(value) else float(value) for name, (value, _) in rows.items()},
        "interval_95": {
            name: np.nanquantile(values, INTERVAL).tolist() for name, (v, values) in rows.items() if v == v
        },
    }


def main() -> None:
    given = options(__doc__).parse_args()
    training = training_of(given)
    torch.set_num_threads(given.threads)
    pictures = [each for folder in given.train for each in read_pictures(folder)]
    print(f"training on {len(pictures)} pictures", flush=True)
    how = {"device": given.device, "loaders": given.loaders, "save_every_s": given.save_every}
    found = fit(SegmentationLesson(pictures), training, given.out, **how)
    for test in given.test:
        name, _, path = test.partition("=")
        tried = read_pictures(Path(path))
        counts = confusions(found, tried, training.size, given.device)
        result = scores(counts, [each.group for each in tried])
        (given.out / f"{name}.json").write_text(json.dumps(result, indent=1) + "\n")
        print(f"{given.out / name}.json: {len(tried)} pictures", flush=True)
    write_result(given.out / RESULT, found, training, len(pictures), given)


if __name__ == "__main__":
    main()

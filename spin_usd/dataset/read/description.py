"""The description that all pictures of a dataset share, from its dataset.json."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from spin_usd.arrays import finite
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.dataset.store.names import DESCRIPTION
from spin_usd.dataset.store.tree import file_at, type_of
from spin_usd.errors import InputError
from spin_usd.scene.source.keypoints import Keypoints
from spin_usd.scene.target import Part


@dataclass(frozen=True, kw_only=True, eq=False)
class Description:
    """target: the target's name · parts: by their ids, the numbers in the segmentation · keypoints: body axes,
    metres."""

    target: str
    parts: Mapping[int, Part]
    keypoints: Keypoints


def read_description(root: Path) -> Description:
    """Read the description of the dataset in the folder `root`. Raises InputError where there is none, or a broken
    one."""
    if root.is_file():
        raise InputError("is a file", where=root, do="give its folder")
    if type_of(root / DESCRIPTION) is None:
        do = "give the folder that spin-usd render made"
        raise InputError(f"is not a dataset: it has no {DESCRIPTION}", where=root, do=do)
    found = read_json(file_at(root, DESCRIPTION), "dataset-1")
    parts = (
        Part(id=int(number), path=part["path"], name=part["name"], class_name=part["class"])
        for number, part in found["parts"].items()
    )
    names, points = tuple(found["keypoints"]), np.reshape(list(found["keypoints"].values()), (-1, 3))
    return Description(
        target=found["target"],
        parts={part.id: part for part in parts},
        keypoints=Keypoints(names=names, points=finite(points, (len(names), 3), "keypoints")),
    )

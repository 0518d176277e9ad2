"""Goes through a dataset as a data loader does: worker processes get places and make batches of arrays.

python load_batches.py DATASET: prints, as JSON, of each picture its frame and sums of its arrays.
"""

import json
import multiprocessing
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from spin_usd import Dataset, Picture

WORKERS, BATCH = 2, 2


def collate(pictures: Sequence[Picture]) -> dict[str, list[str] | np.ndarray]:
    """A batch: arrays of all pictures, stacked."""
    return {
        "frame": [picture.frame for picture in pictures],
        "image": np.stack([picture.image for picture in pictures]),
        "dense_pose": np.stack([picture.dense_pose for picture in pictures]),
        "T_cam_body": np.stack([picture.T_cam_body for picture in pictures]),
    }


def load(dataset: Dataset, places: range) -> dict[str, list[str] | np.ndarray]:
    return collate([dataset[place] for place in places])


def main(path: str) -> None:
    dataset = Dataset(path)
    batches = [range(start, min(start + BATCH, len(dataset))) for start in range(0, len(dataset), BATCH)]
    found = {}
    with ProcessPoolExecutor(WORKERS, mp_context=multiprocessing.get_context("spawn")) as pool:
        for batch in pool.map(load, [dataset] * len(batches), batches):
            for row, frame in enumerate(batch["frame"]):
                sums = {name: float(np.sum(batch[name][row], dtype=np.float64)) for name in batch if name != "frame"}
                found[str(frame)] = sums
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1])

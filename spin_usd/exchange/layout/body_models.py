"""The models of a dataset's targets, from the copy of the stage that it holds."""

import tempfile
from collections import defaultdict
from functools import lru_cache
from pathlib import Path

import numpy as np

from spin_usd.exchange.layout.exported_dataset import ExportedDataset
from spin_usd.exchange.layout.model import Model
from spin_usd.files.folder import Folder
from spin_usd.processes.ask_child import ask_child


@lru_cache(maxsize=1)
def body_models(dataset: ExportedDataset) -> dict[int, Model]:
    """Return the model of each target by its id. Raises StageError, UnsupportedError for a target that changes its
    shape."""
    frames: dict[str, list[str]] = defaultdict(list)
    for entry in dataset.entries:
        frames[entry.variant].append(entry.frame)
    stage = dataset.picture(0).picture.record["provenance"]["stage"]["root"]
    root = Folder(dataset.dataset.root).path(stage)
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder:
        ids = ask_child("save_models", reads=root, stage=str(root), folder=folder, frames=frames)
        return {number: _loaded(Path(folder, f"{number}.npz")) for number in ids}


def _loaded(path: Path) -> Model:
    with np.load(path) as arrays:
        return Model(points=arrays["points"], faces=arrays["faces"])

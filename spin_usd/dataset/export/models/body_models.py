"""The models of a dataset's targets, from the copy of the stage that it holds."""

import tempfile
from collections import defaultdict
from functools import lru_cache
from pathlib import Path

import numpy as np

from spin_usd.dataset.export.layout.exported_dataset import ExportedDataset
from spin_usd.dataset.export.models.model import Model
from spin_usd.dataset.process.child import STAGE_PATIENCE_S, Child, ChildDiedError, stage_memory
from spin_usd.dataset.store.tree import file_at
from spin_usd.errors import StageError
from spin_usd.progress import ignore


@lru_cache(maxsize=1)
def body_models(dataset: ExportedDataset) -> dict[int, Model]:
    """Return the model of each target by its id. Raises StageError, UnsupportedError for a target that changes its
    shape."""
    frames: dict[str, list[str]] = defaultdict(list)
    for entry in dataset.entries:
        frames[entry.variant].append(entry.frame)
    stage = dataset.picture(0).picture.record["provenance"]["stage"]["root"]
    root = file_at(dataset.dataset.root, stage)
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder, Child(memory=stage_memory()) as child:
        try:
            ids = child.call(
                "save_models",
                stage=str(root),
                folder=folder,
                frames=frames,
                progress=ignore,
                within_s=STAGE_PATIENCE_S,
            )
        except ChildDiedError as died:
            do = "simplify it, or look for what multiplies in it"
            raise StageError(f"cannot be read: {died.found}", where=root, do=do) from died
        return {number: _loaded(Path(folder, f"{number}.npz")) for number in ids}


def _loaded(path: Path) -> Model:
    with np.load(path) as arrays:
        return Model(points=arrays["points"], faces=arrays["faces"])

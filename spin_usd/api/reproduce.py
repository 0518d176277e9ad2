"""One picture made again."""

from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.dataset.reproduce import reproduce as reproducing
from spin_usd.scene.model import NOMINAL


@checked
def reproduce(dataset: str | Path, frame: str, *, variant: str = NOMINAL) -> reproducing.Reproduction:
    """Make one picture again from its provenance and compare it with the one there.

    Args:
        dataset: a dataset's folder.
        frame: the name of a frame, such as "img000001".
        variant: the name of its variant.

    Raises InputError where the dataset has no such picture.
    """
    return reproducing.reproduce(Path(dataset), frame, variant=variant)

"""One picture made again."""

from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.dataset.reproduce import reproduce as reproducing
from spin_usd.scene.model import NOMINAL


@checked
def reproduce(
    dataset: str | Path, frame: str, *, variant: str = NOMINAL, device: str | None = None
) -> reproducing.Reproduction:
    """Make one picture again from its provenance and compare it with the one there.

    Args:
        dataset: a dataset's folder.
        frame: the name of a frame, such as "img000001".
        variant: the name of its variant.
        device: what renders its light: "cpu", "optix", "cuda", "hip", "metal" or "oneapi"; the recorded one if not
            given. On another one the image's bytes may differ.

    Raises InputError where the dataset has no such picture, UnsupportedError where this machine has no such device.
    """
    return reproducing.reproduce(Path(dataset), frame, variant=variant, device=device)

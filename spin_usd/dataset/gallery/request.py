"""The request that a user makes to `show`."""

from dataclasses import dataclass
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.labels.table import PIXEL_LABELS

JPEG, SMALL, ORIGINAL = "jpeg", "small", "original"
IMAGES = (JPEG, SMALL, ORIGINAL)


@dataclass(frozen=True, kw_only=True)
class GalleryRequest:
    """dataset: its folder · out: the page's folder · beside: a dataset whose distributions are shown too · labels: the
    kinds shown over the images, as far as pictures have them · images: JPEG in full size, SMALL or ORIGINAL · workers:
    child processes, None for as many as there are processors."""

    dataset: Path
    out: Path
    beside: Path | None = None
    labels: tuple[str, ...] = tuple(PIXEL_LABELS)
    images: str = JPEG
    workers: int | None = None

    def __post_init__(self) -> None:
        if self.images not in IMAGES:
            raise InputError(f"there are no images {self.images!r}", do=f"choose {', '.join(IMAGES)}")
        for label in self.labels:
            if label not in PIXEL_LABELS:
                raise InputError(f"there is no label {label!r} of pixels", do=f"choose among {', '.join(PIXEL_LABELS)}")

"""The options of `show`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated

from spin_usd.basics.suggestion import suggestion
from spin_usd.completions import listed_in
from spin_usd.errors import InputError
from spin_usd.options import Dataset, Listening, Option, Workers, names_in

JPEG, SMALL, ORIGINAL = "jpeg", "small", "original"
IMAGES = (JPEG, SMALL, ORIGINAL)


@dataclass(frozen=True)
class ShowOptions(Listening):
    """The contents of the page, and its folder."""

    dataset: Dataset
    _: KW_ONLY
    out: Annotated[
        str | Path | None,
        Option("Folder of the page; DATASET_page if not given. Another run updates what changed.", "PATH"),
    ] = None
    beside: Annotated[
        str | Path | None,
        Option("Dataset to compare: its distributions, and pictures of equal names.", "DATASET"),
    ] = None
    labels: Annotated[
        str | Sequence[str],
        Option("Labels to show over the images, such as depth,segmentation; or none.", "NAME,..."),
    ] = "all"
    images: Annotated[
        str,
        Option(
            "jpeg: full size; small: 960 pixels wide; original: the dataset's own files.",
            "NAME",
            words=listed_in("spin_usd.commands.show.options", "IMAGES"),
        ),
    ] = JPEG
    workers: Workers = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.images not in IMAGES:
            raise InputError(f"there are no images {self.images!r}", do=f"choose {', '.join(IMAGES)}")

    @cached_property
    def label_names(self) -> tuple[str, ...]:
        """The labels to show, as far as pictures have them. Raises InputError for an unknown one."""
        from spin_usd.labels.table import PIXEL_LABELS  # not above: it loads numpy, which would slow --help

        groups = {"all": tuple(PIXEL_LABELS), "none": ()}
        found = tuple(label for name in names_in(self.labels) for label in groups.get(name, (name,)))
        for label in found:
            if label not in PIXEL_LABELS:
                raise InputError(f"there is no label {label!r} of pixels", do=suggestion(label, PIXEL_LABELS))
        return found

    @property
    def page_folder(self) -> Path:
        """The page's folder, absolute: my_dataset_page beside my_dataset if not given."""
        beside = Path(self.dataset).absolute()
        return Path(self.out).absolute() if self.out else beside.with_name(f"{beside.name}_page")

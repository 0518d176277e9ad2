"""The options of `export`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.completions import listed_in
from spin_usd.errors import InputError
from spin_usd.options import MAX_WORKERS, Dataset, Frames, Listening, Option, names_in


@dataclass(frozen=True)
class ExportOptions(Listening):
    """The dataset to export, and the format."""

    dataset: Dataset
    _: KW_ONLY
    to: Annotated[
        str,
        Option(
            "The format; --list lists all.",
            "NAME",
            words=listed_in("spin_usd.exchange.table", "EXPORT_FORMATS"),
        ),
    ]
    out: Annotated[str | Path, Option("Folder of the export; another run adds what is missing.", "PATH")]
    split: Annotated[
        str | None,
        Option("Shares of the splits, such as train=0.8,validation=0.2; all train if not given.", "NAME=SHARE,..."),
    ] = None
    seed: Annotated[
        int, Option("Seed that assigns poses to splits; all variants of a pose go into the same split.", "N")
    ] = 0
    frames: Frames = None
    variants: Annotated[
        str | Sequence[str], Option("Names, patterns such as 'noisy_*', or all; all if not given.", "NAME,...")
    ] = ()
    tags: Annotated[
        str | Sequence[str],
        Option(
            "Only pictures with one of these tags from the page of show; can be repeated.",
            "NAME,...",
            repeated=True,
        ),
    ] = ()
    tags_file: Annotated[
        str | Path | None, Option("With --tags: the file of tags; the dataset's tags.json if not given.", "PATH")
    ] = None
    target: Annotated[
        str | None,
        Option(
            "The target, for formats with one target, without pictures that do not show it; if not given, the first, "
            "or what a picture shows instead.",
            "NAME",
        ),
    ] = None
    option: Annotated[
        str | Sequence[str],
        Option("An option of the format; can be repeated.", "NAME=VALUE", repeated=True),
    ] = ()
    copy: Annotated[bool, Option("Copy files that need no change, instead of hard-linking them.")] = False
    workers: Annotated[
        int, Option("Worker processes; their number changes no byte.", "N", at_least=1, at_most=MAX_WORKERS)
    ] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tags_file and not self.tag_names:
            raise InputError("tags_file is given without tags", do="add --tags NAME")

    @property
    def written(self) -> tuple[Path, ...]:
        """The folders that are written: the export's, and the dataset's unless files are copied, as they get links."""
        return (Path(self.out), *([] if self.copy else [Path(self.dataset)]))

    @property
    def tag_names(self) -> tuple[str, ...]:
        """The tags, of which a picture needs at least one; empty for all pictures."""
        each = [self.tags] if isinstance(self.tags, str) else self.tags
        return tuple(name for given in each for name in names_in(given))

    @property
    def format_options(self) -> dict[str, str]:
        """The format's options by name. Raises InputError for text that is not NAME=VALUE."""
        found: dict[str, str] = {}
        for text in names_in(self.option):
            name, equals, value = (part.strip() for part in text.partition("="))
            if not equals or not name or name in found:
                do = "write for example masks=parts, each name once"
                raise InputError(f"option {text!r} is not NAME=VALUE", do=do)
            found[name] = value
        return found

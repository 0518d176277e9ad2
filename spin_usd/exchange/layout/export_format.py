"""A format of exports: its requirements on the pictures, and the files that it makes.

A format is one file in `exchange` and one entry in `table.py`. The framework links, copies and makes the files, skips
existing ones, streams the rows into the indexes, and puts everything into place atomically. Pictures come one at a
time, in the dataset's order of variants and frames, and are not kept: an export of 10,000 needs no more memory than one
of 10.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from spin_usd.errors import InputError
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.index_file import IndexFile
from spin_usd.exchange.layout.survey import Survey
from spin_usd.files.folder import FileIn


@dataclass(frozen=True, kw_only=True)
class LinkedFile:
    """A file of the dataset that goes into the export unchanged: a hard link of `source`, or a copy if requested."""

    path: str
    source: FileIn


@dataclass(frozen=True, kw_only=True)
class MadeFile:
    """A file that `write` fills at the path that it is given. It is not called where the export has the file already,
    so all that is costly belongs in it.

    Of a file of many pictures, such as a shard, the last of them yields it; `write` reads them again by
    `ExportedDataset.picture`.
    """

    path: str
    write: Callable[[Path], None]


@dataclass(frozen=True, kw_only=True)
class SecondName:
    """A second name, `path`, of an earlier file `of` of the export: a hard link, or a copy if requested."""

    path: str
    of: str


@dataclass(frozen=True, kw_only=True)
class IndexRow:
    """An entry of the index `path`; entries keep the order in which they come."""

    path: str
    value: Any
    """Value for that index's style."""
    section: str = ""
    """The list that it goes to, in an index of several."""


ExportFile: TypeAlias = LinkedFile | MadeFile | SecondName
Output: TypeAlias = ExportFile | IndexRow
"""An output of a format; paths are relative to the export's folder."""

Limit = Callable[[Survey], None]
"""Raises UnsupportedError for content that the format cannot hold, naming the picture and a remedy."""


def _no_files(dataset: ExportedDataset) -> Iterator[ExportFile]:
    return iter(())


def _nothing_last(dataset: ExportedDataset, out: Path) -> Iterator[MadeFile]:
    return iter(())


def _no_indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {}


def _nothing_refused(dataset: ExportedDataset) -> None:
    """Take all pictures."""


def _no_head(dataset: ExportedDataset) -> str:
    return ""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """The layout that a format gives a dataset: it yields outputs, and writes nothing itself.

    Content that a format cannot hold is refused before anything is written: by `needs`, `splits`, `limits` and
    `refuse`. Only limits that need a file's pixels, such as an occluder's distance, are refused by `write`.
    """

    needs: tuple[str, ...]
    """The kinds of file that every picture must have, such as "image"."""
    conventions: tuple[str, ...]
    """Sentences for the card: axes, quaternion, units, pixel origin, order of boxes, conversions."""
    files: Callable[[ExportedDataset, ExportedPicture], Iterator[Output]]
    """The outputs of one picture: a `LinkedFile` if the dataset's file fits unchanged, else a `MadeFile`, and an
    `IndexRow` for each entry in an index."""
    shared: Callable[[ExportedDataset], Iterator[ExportFile]] = _no_files
    """Outputs that belong to no picture, such as camera.json, once."""
    indexes: Callable[[ExportedDataset], Mapping[str, IndexFile]] = _no_indexes
    """The files that rows of many pictures go to, such as train.json, by their path, and their style
    (index_file.py)."""
    card_head: Callable[[ExportedDataset], str] = _no_head
    """Text before the card's own, such as the YAML that a hub reads."""
    last: Callable[[ExportedDataset, Path], Iterator[MadeFile]] = _nothing_last
    """Outputs that need the finished indexes, which lie in the folder given."""
    limits: tuple[Limit, ...] = ()
    """Refusals (limits.py) after a survey (survey.py) has read every record."""
    refuse: Callable[[ExportedDataset], object] = _nothing_refused
    """Raises InputError or UnsupportedError for limits that a survey does not cover, before anything is written."""
    splits: Mapping[str, str] | None = None
    """The names that the format gives the splits "train", "validation" and "test"; None where any name will do."""
    file: Callable[[ExportedDataset, ExportedPicture], str] | None = None
    """The path of a picture's image, if it is not the path of the first output of `files`."""
    several: bool = False
    """True if the format holds all targets of a picture, not only the chosen one."""
    first_centre: float = 0.5
    """Where the first pixel has its centre in the format's own files, CENTRE or CORNER."""
    visible_only: bool = False
    """Whether pictures that show nothing of the target are left out, as a format of boxes has to."""


@dataclass(frozen=True, kw_only=True)
class FormatOption:
    """An option of a format, given as NAME=VALUE."""

    name: str
    meaning: str
    """A phrase."""
    default: str
    """Its value if it is not given."""
    choices: tuple[str, ...] = ()
    """All that it can be; empty where `read` decides."""
    read: Callable[[str], Any] = str
    """The value of a text; raises ValueError."""

    def value(self, text: str) -> Any:
        """Return the value of `text`. Raises InputError that names the option."""
        try:
            if self.choices and text not in self.choices:
                raise ValueError
            return self.read(text)
        except ValueError:
            do = f"choose {' or '.join(self.choices)}" if self.choices else f"give {self.meaning}"
            raise InputError(f"option {self.name}={text!r} is not possible", do=do) from None


def from_one(text: str) -> int:
    """Read a whole number from 1, for a FormatOption. Raises ValueError."""
    number = int(text)
    if number < 1:
        raise ValueError
    return number


@dataclass(frozen=True, kw_only=True)
class ExportFormat:
    """A format that datasets are exported to."""

    name: str
    """In `--to`."""
    holds: str
    """Phrase that describes it."""
    layout: Layout | Callable[[Mapping[str, Any]], Layout]
    """The layout, or a function that returns it for the values of the options, by name."""
    options: tuple[FormatOption, ...] = field(default=())
    """Options of the format."""

    def layout_for(self, options: Mapping[str, Any]) -> Layout:
        """Return the layout for these values of its options."""
        return self.layout if isinstance(self.layout, Layout) else self.layout(options)

    def values(self, given: Mapping[str, str]) -> dict[str, Any]:
        """Return the value of every option, `given` as text or by default. Raises InputError for one that there is
        not."""
        names = [option.name for option in self.options]
        for name in given:
            if name not in names:
                do = f"choose among {', '.join(names)}" if names else "leave it out"
                raise InputError(f"{self.name} has no option {name!r}", do=do)
        return {option.name: option.value(given.get(option.name, option.default)) for option in self.options}

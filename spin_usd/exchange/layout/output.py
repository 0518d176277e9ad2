"""Outputs: what a format yields, and the framework writes. Every `path` is relative to the export's folder."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from spin_usd.files.folder import FileIn


@dataclass(frozen=True, kw_only=True)
class LinkedFile:
    """A file of the dataset that goes into the export as it is: a hard link of `source`, or a copy where asked for."""

    path: str
    source: FileIn


@dataclass(frozen=True, kw_only=True)
class MadeFile:
    """A file that `write` fills at the path that it is given. It is not called where the export has the file already,
    so all that is costly belongs in it."""

    path: str
    write: Callable[[Path], None]


@dataclass(frozen=True, kw_only=True)
class SecondName:
    """A second name, `path`, of the file `of` that came before it in the export: a hard link, or a copy where asked
    for."""

    path: str
    of: str


@dataclass(frozen=True, kw_only=True)
class IndexRow:
    """An entry of the index `path`, in the order in which they come. value: what that index's style takes · section:
    the list that it goes to, in an index of several."""

    path: str
    value: Any
    section: str = ""


ExportFile: TypeAlias = LinkedFile | MadeFile | SecondName
Output: TypeAlias = ExportFile | IndexRow

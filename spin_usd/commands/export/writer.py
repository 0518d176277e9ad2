"""The files of an export as they are written: linked, copied, made, or streamed a row at a time."""

from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import accumulate
from pathlib import Path, PurePosixPath
from shutil import copyfileobj
from typing import NamedTuple, TextIO

from spin_usd.errors import InputError, OutputError, UnsupportedError
from spin_usd.exchange.layout.export_format import ExportFile, LinkedFile, MadeFile, SecondName
from spin_usd.exchange.layout.index_file import IndexFile
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.name import parts_of
from spin_usd.files.node import STRANGE
from spin_usd.store.atomic import fill_atomically, link_atomically


@dataclass(kw_only=True)
class Counts:
    """Files that were linked or copied, made, by the endings of their names, and there already."""

    linked: int = 0
    made: dict[str, int] = field(default_factory=dict)
    kept: int = 0

    def add(self, more: "Counts") -> None:
        """Count these too."""
        self.linked += more.linked
        for ending, number in more.made.items():
            self.made[ending] = self.made.get(ending, 0) + number
        self.kept += more.kept


class RowText(NamedTuple):
    """The text of a row in an index: the index's path, the section, the row."""

    path: str
    section: str
    text: str


@dataclass(kw_only=True)
class _Spool:
    """The rows of one section so far, in a file of the work folder."""

    file: TextIO
    rows: int = 0


@dataclass(kw_only=True)
class Writer:
    """Writes outputs into the folder `out`; `work` is for unfinished files.

    Existing files are kept: each was put there complete, by the same export. Indexes come last and from their first
    row, since a resumed run yields the same rows again.
    """

    out: Path
    work: Path
    copy: bool
    indexes: Mapping[str, IndexFile] = field(default_factory=dict)
    counts: Counts = field(default_factory=Counts)
    _spools: dict[tuple[str, str], _Spool] = field(default_factory=dict)
    _open: ExitStack = field(default_factory=ExitStack)

    def __post_init__(self) -> None:
        for number, (path, index) in enumerate(self.indexes.items()):
            for place, section in enumerate(index.sections):
                spool = (self.work / f"{number}-{place}").open("w+", encoding="utf-8")
                self._spools[path, section] = _Spool(file=self._open.enter_context(spool))

    def close(self) -> None:
        """Close all files. Rows lost to a full disk are in no index either."""
        with suppress(OSError):
            self._open.close()

    def write(self, output: ExportFile) -> None:
        """Write one output. Raises InputError if a link is in its way, OutputError, and like a file's own `write`."""
        folder = Folder(self.out)
        self._refuse_strange(folder, output.path)
        if folder.type_of(output.path):
            self.counts.kept += 1
        elif isinstance(output, LinkedFile | SecondName):
            source = output.source if isinstance(output, LinkedFile) else FileIn(folder, output.of)
            link_atomically(folder, output.path, source, work=self.work, copy=self.copy)
            self.counts.linked += 1
        else:
            fill_atomically(folder, output.path, output.write, work=self.work)
            self.counts.add(Counts(made={PurePosixPath(output.path).suffix or output.path: 1}))

    def finish(self) -> None:
        """Put the indexes into place."""
        for path, index in self.indexes.items():
            self.write(MadeFile(path=path, write=partial(self._assemble, path, index)))

    def _refuse_strange(self, folder: Folder, name: str) -> None:
        """Raise UnsupportedError for a name that leads out of the export, and InputError for a link on its way, which
        may lead out of it too."""
        try:
            parts = parts_of(name, self.out)
        except InputError:
            do = "rename its source"
            raise UnsupportedError(f"cannot name the file {name!r}", where=self.out, do=do) from None
        for place in accumulate(parts, "{}/{}".format):
            if (found := folder.type_of(place)) in STRANGE:
                do = "replace it by its target, or remove it"
                raise InputError(f"is a {found}, which is not followed", where=self.out / place, do=do)

    def add(self, row: RowText) -> None:
        """Add a row to its index. Raises OutputError."""
        index, spool = self.indexes[row.path], self._spools[row.path, row.section]
        try:
            spool.file.write(index.sections[row.section].between + row.text if spool.rows else row.text)
        except OSError as e:
            raise OutputError(
                f"cannot be written ({e.strerror})", where=self.out / row.path, do="free some space"
            ) from e
        spool.rows += 1

    def _assemble(self, path: str, index: IndexFile, to: Path) -> None:
        """Write the sections, one after the other, into the file `to`."""
        with to.open("w", encoding="utf-8") as file:
            for name, section in index.sections.items():
                spool = self._spools[path, name].file
                spool.flush()
                spool.seek(0)
                file.write(section.before)
                copyfileobj(spool, file)
                file.write(section.after)

"""The pictures of an export, made here or by children that take a few at a time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from msgspec import Struct, to_builtins

from spin_usd.basics.nesting import typed_json
from spin_usd.basics.progress import no_progress
from spin_usd.commands.export.options import ExportOptions
from spin_usd.commands.export.run import PATIENCE_S
from spin_usd.commands.export.writer import Counts, RowText, Writer
from spin_usd.errors import SpinError
from spin_usd.exchange.layout.export_format import IndexRow, Layout
from spin_usd.exchange.layout.exported_dataset import Entry, ExportedDataset
from spin_usd.exchange.layout.index_file import IndexFile, csv_table
from spin_usd.exchange.table import format_named
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.files.user_file import read_text
from spin_usd.processes.ask_child import unreadable
from spin_usd.processes.child import Child
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.shared_calls import Call, results_of
from spin_usd.reading.dataset import Dataset
from spin_usd.records.record import RecordedCamera
from spin_usd.store.atomic import write_json

LIST = "pictures.csv"
"""Lists the pictures of every export: their names there, and their names in the dataset."""
SHARE = 8  # pictures per request to a child


class Made(NamedTuple):
    """Results of some pictures: rows for the indexes, in their order, and numbers of files."""

    rows: Sequence[RowText]
    counts: Counts


class _Plan(Struct, frozen=True, kw_only=True):
    """The fields of an ExportedDataset for children, in a file."""

    entries: tuple[Entry, ...]
    splits: tuple[str, ...]
    target: str
    cameras: tuple[RecordedCamera, ...]
    farthest: float


class PictureMaker:
    """Makes the files of pictures of an export, and the rows that they have in its indexes."""

    def __init__(self, exported: ExportedDataset, layout: Layout, request: ExportOptions, work: Path) -> None:
        self._exported, self._layout = exported, layout
        self._indexes = all_indexes(exported, layout)
        self._writer = Writer(out=Path(request.out), work=work, copy=request.copy)

    @classmethod
    def of_plan(cls, plan: str, request: Mapping[str, Any], work: str) -> "PictureMaker":
        """Make the one of the `plan`, a file that `made_by_children` wrote."""
        said, asked = typed_json(read_text(plan, MAX_POSE_LIST), _Plan), ExportOptions(**request)
        to = format_named(asked.to)
        options = to.values(asked.format_options)
        exported = ExportedDataset(
            dataset=Dataset(Path(asked.dataset)),
            entries=said.entries,
            splits=said.splits,
            target=said.target,
            cameras=tuple(each.camera for each in said.cameras),
            farthest=said.farthest,
            options=options,
        )
        return cls(exported, to.layout_for(options), asked, Path(work))

    def make(self, first: int, last: int) -> Made:
        """Make the pictures from index `first` to before `last`. Raises like Writer.write."""
        self._writer.counts = Counts()
        rows = []
        for number in range(first, min(last, len(self._exported))):
            picture = self._exported.picture(number)
            outputs = list(self._layout.files(self._exported, picture))
            file = self._layout.file(self._exported, picture) if self._layout.file else outputs[0].path
            rows.append(IndexRow(path=LIST, value=(*self._exported.entries[number], file)))
            for output in outputs:
                if isinstance(output, IndexRow):
                    rows.append(output)
                else:
                    self._writer.write(output)
        return Made(
            [RowText(row.path, row.section, self._indexes[row.path].text(row.value)) for row in rows],
            self._writer.counts,
        )


class PictureMakers:
    """The makers of a child process: one for each plan."""

    def __init__(self) -> None:
        self._of: dict[str, PictureMaker] = {}

    def make(self, plan: str, first: int, last: int, **how: Any) -> tuple[Sequence[RowText], dict[str, int]]:
        """Make some pictures of the `plan`; `how` has the further arguments of PictureMaker.of_plan."""
        maker = self._of[plan] = self._of.get(plan) or PictureMaker.of_plan(plan, **how)
        rows, counts = maker.make(first, last)
        return rows, asdict(counts)


def all_indexes(exported: ExportedDataset, layout: Layout) -> Mapping[str, IndexFile]:
    """Return the indexes of the export by their paths, the list of its pictures among them."""
    return {LIST: csv_table((*Entry._fields, "file")), **layout.indexes(exported)}


def made_here(exported: ExportedDataset, layout: Layout, request: ExportOptions, work: Path) -> Iterator[Made]:
    """Make all pictures one at a time, and yield the result of each."""
    maker = PictureMaker(exported, layout, request, work)
    return (maker.make(number, number + 1) for number in range(len(exported)))


def made_by_children(
    exported: ExportedDataset, request: ExportOptions, work: Path, descriptors: tuple[int, ...]
) -> Iterator[Made]:
    """Let the request's number of children make the pictures, and yield the results, in their order.

    descriptors: the lock's, which children hold as long as they write.
    """
    plan = "plan.json"
    said = _Plan(
        entries=tuple(exported.entries),
        splits=tuple(exported.splits),
        target=exported.target,
        cameras=tuple(map(RecordedCamera.of, exported.cameras)),
        farthest=exported.farthest,
    )
    write_json(Folder(work), plan, to_builtins(said), work=work)
    given = {"plan": str(work / plan), "request": request.as_json(), "work": str(work)}
    shares = range(0, len(exported), SHARE)
    calls = [Call("export_pictures", {**given, "first": first, "last": first + SHARE}) for first in shares]
    start = partial(Child, keep_open=descriptors)
    for result in results_of(calls, request.workers, progress=no_progress, start=start, within_s=PATIENCE_S):
        if isinstance(result, ChildDiedError):
            raise unreadable(result, Path(request.dataset)) from result
        if isinstance(result, SpinError):
            raise result
        rows, counts = result
        yield Made([RowText(*row) for row in rows], Counts(**counts))

"""The pictures of an export, made here or by children that take a few at a time."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from msgspec import Struct, structs, to_builtins

from spin_usd.basics.nesting import typed_json
from spin_usd.commands.export.options import ExportOptions
from spin_usd.commands.export.run import PATIENCE_S
from spin_usd.commands.export.writer import Counts, RowText, Writer
from spin_usd.exchange.layout.export_format import IndexRow, Layout
from spin_usd.exchange.layout.exported_dataset import Entry, ExportedDataset
from spin_usd.exchange.layout.index_file import IndexFile, csv_table
from spin_usd.exchange.table import format_named
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.files.user_file import read_text
from spin_usd.processes.ask_child import unreadable
from spin_usd.processes.call import Call
from spin_usd.processes.child import Child
from spin_usd.processes.deaths import READING_TRIES, ChildDiedError
from spin_usd.processes.executor import done_in_order
from spin_usd.processes.task import Task
from spin_usd.reading.dataset import Dataset
from spin_usd.records.record import RecordedCamera
from spin_usd.store.atomic import write_json

LIST = "pictures.csv"
"""Lists the pictures of every export: their names there, and their names in the dataset."""
SHARE = 8  # pictures per request to a child


class Made(NamedTuple):
    """Some pictures that were made."""

    rows: Sequence[RowText]
    """Rows for the indexes, in their order."""
    counts: Counts
    """Numbers of files."""


class MakePictures(Struct, frozen=True, kw_only=True):
    """The request for some pictures of an export."""

    plan: str
    """File of the plan, which `made_by_children` wrote."""
    request: dict[str, Any]
    """ExportOptions as JSON."""
    work: str
    """Folder for temporary files."""
    first: int
    last: int
    """Place after the last picture."""


MAKE_PICTURES = Call("spin_usd.commands.export.pictures:PictureMakers.make", MakePictures, Made)


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
    def of_request(cls, request: MakePictures) -> "PictureMaker":
        """Make the one for a request's plan."""
        said, asked = typed_json(read_text(request.plan, MAX_POSE_LIST), _Plan), ExportOptions(**request.request)
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
        return cls(exported, to.layout_for(options), asked, Path(request.work))

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

    def make(self, request: MakePictures) -> Made:
        """Make some pictures."""
        maker = self._of[request.plan] = self._of.get(request.plan) or PictureMaker.of_request(request)
        return maker.make(request.first, request.last)


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
    asked = MakePictures(plan=str(work / plan), request=request.as_json(), work=str(work), first=0, last=SHARE)
    shares = (structs.replace(asked, first=first, last=first + SHARE) for first in range(0, len(exported), SHARE))
    tasks = [Task(call=MAKE_PICTURES, request=share, within_s=PATIENCE_S, tries=READING_TRIES) for share in shares]
    start = partial(Child, keep_open=descriptors, modules=(MAKE_PICTURES.module,), writes=request.written)
    for task in done_in_order(tasks, request.workers, start=lambda _: start()):
        if isinstance(task.failure, ChildDiedError):
            raise unreadable(task.failure, Path(request.dataset)) from task.failure
        yield task.result

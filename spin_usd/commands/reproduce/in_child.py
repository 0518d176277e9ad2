"""The child's part of `reproduce`: one recorded picture rendered again, without the dataset's cache."""

from dataclasses import replace
from pathlib import Path

from msgspec import to_builtins

from spin_usd.commands.render.worker import Worker
from spin_usd.commands.reproduce.report import Comparison, Reproduction
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.node import NodeType
from spin_usd.picture.kinds import RENDERED
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.records.record import RecordedFile
from spin_usd.store.read_documents import read_record


def make_again(*, dataset: str, record: str, folder: str, device: str) -> Reproduction:
    """Render into `folder` from the dataset's stage with the settings of the record in the file `record`, light on the
    `device`, and compare digests."""
    there = Folder(Path(dataset))
    said = read_record(there, record)
    kinds = tuple(said.files)
    options = WorkerOptions(
        root=folder,
        work=folder,
        stage=str(there.path(said.provenance.stage.root)),
        options=said.options,
        settings=replace(said.settings, device=device),
        renders=not RENDERED.isdisjoint(kinds),
    )
    worker = Worker(options=to_builtins(options))
    frames = worker.reader(said.variant).frames
    if said.index >= len(frames) or frames[said.index].name != said.frame:
        raise InputError(f"the stage no longer holds picture {said.frame!r} at place {said.index}", where=dataset)
    _, made = worker.make(variant=said.variant, index=said.index, kinds=kinds, keep_render=False)
    if unknown := [kind for kind in kinds if kind not in made.files]:
        raise InputError(f"the record lists {unknown[0]}, which this version does not make", where=dataset)
    recorded, now = said.provenance.versions, worker.versions
    return Reproduction(
        files=tuple(_compared(there, kind, said.files[kind], made.files[kind]) for kind in kinds),
        versions={
            name: (recorded.get(name, ""), now.get(name, ""))
            for name in sorted({*recorded, *now})
            if recorded.get(name) != now.get(name)
        },
        devices=(said.settings.device, device),
    )


def _compared(folder: Folder, kind: str, recorded: RecordedFile, again: RecordedFile) -> Comparison:
    return Comparison(
        kind=kind,
        path=recorded.path,
        recorded=recorded.sha256,
        found=folder.sha256(recorded.path) if folder.type_of(recorded.path) is NodeType.FILE else None,
        again=again.sha256,
    )

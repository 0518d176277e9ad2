"""The child's part of `reproduce`: one recorded picture rendered again, without the dataset's cache."""

from dataclasses import replace
from pathlib import Path

from spin_usd.commands.render.calls import MakePicture, OpenWorker
from spin_usd.commands.render.worker import RenderWorker
from spin_usd.commands.reproduce.report import Comparison, Reproduce, Reproduction
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.node import NodeType
from spin_usd.picture.kinds import RENDERED
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.records.record import RecordedFile
from spin_usd.store.read_documents import read_record


def make_again(request: Reproduce) -> Reproduction:
    """Render a recorded picture from the dataset's stage with the settings of its record, and compare digests."""
    there = Folder(Path(request.dataset))
    record = read_record(there, request.record)
    kinds = tuple(record.files)
    options = WorkerOptions(
        root=request.folder,
        work=request.folder,
        stage=str(there.path(record.provenance.stage.root)),
        options=record.options,
        settings=replace(record.settings, device=request.device),
        renders=not RENDERED.isdisjoint(kinds),
    )
    worker = RenderWorker(OpenWorker(options=options))
    frames = worker.stage.reader(record.variant).frames
    if record.index >= len(frames) or frames[record.index].name != record.frame:
        found = f"the stage no longer holds picture {record.frame!r} at place {record.index}"
        raise InputError(found, where=request.dataset)
    _, made = worker.make(MakePicture(variant=record.variant, index=record.index, kinds=kinds, keep_render=False))
    if unknown := [kind for kind in kinds if kind not in made.files]:
        raise InputError(f"the record lists {unknown[0]}, which this version does not make", where=request.dataset)
    recorded, now = record.provenance.versions, worker.studio.versions
    return Reproduction(
        files=tuple(_compared(there, kind, record.files[kind], made.files[kind]) for kind in kinds),
        versions={
            name: (recorded.get(name, ""), now.get(name, ""))
            for name in sorted({*recorded, *now})
            if recorded.get(name) != now.get(name)
        },
        devices=(record.settings.device, request.device),
    )


def _compared(folder: Folder, kind: str, recorded: RecordedFile, again: RecordedFile) -> Comparison:
    return Comparison(
        kind=kind,
        path=recorded.path,
        recorded=recorded.sha256,
        found=folder.sha256(recorded.path) if folder.type_of(recorded.path) is NodeType.FILE else None,
        again=again.sha256,
    )

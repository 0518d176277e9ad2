"""Puts the stage and dataset.json into a dataset's folder; removes pictures of another stage first."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from spin_usd.basics.stop_signals import postponed
from spin_usd.commands.render.render_run import RenderRun
from spin_usd.errors import OutputError
from spin_usd.files.changes import put
from spin_usd.files.folder import Folder
from spin_usd.labels.table import LABELS
from spin_usd.options import RunOptions
from spin_usd.picture.kinds import FILE_KINDS, IMAGE, IMAGE_MEANING, RADIANCE, RADIANCE_CHANNELS
from spin_usd.planning import orphans, same_stage
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.shard import Manifest, write_manifest
from spin_usd.records.descriptions import DatasetDescription, StageEntry
from spin_usd.scene.derived.part_classes import class_ids
from spin_usd.store.atomic import force_folder, write_json
from spin_usd.store.dataset_folder import Store
from spin_usd.store.file_digests import CHANGED, same_files, same_names, write_sums
from spin_usd.store.names import DESCRIPTION, STAGE
from spin_usd.store.read_documents import read_dataset_json
from spin_usd.store.stage_layers import refuse_changed_stage

MEANINGS = {
    IMAGE: IMAGE_MEANING,
    RADIANCE: RADIANCE_CHANNELS.meaning,
    **{name: label.channels.meaning for name, label in LABELS.items()},
}


def put_stage(run: RenderRun, planned: Plan, root: str, kinds: Sequence[str]) -> int:
    """Put the stage, with its new root layer `root`, and dataset.json, with these kinds of file, into the run's folder;
    return how many pictures of another stage were removed."""
    store, work = run.store, run.lease.work
    with postponed():
        if not run.owns_stage:
            refuse_changed_stage(store, CHANGED, do="move stage/ elsewhere", new=run.copied)
        removed = _remove_unwanted(store, planned, run.options)
        if run.shard:
            manifest = Manifest(count=run.shard.count, variants=planned.variants, frames=planned.frames)
            write_manifest(store, manifest, work=work)
        write_json(store.folder, DESCRIPTION, describe(store, planned, root, kinds), work=work)
        if not run.owns_stage:
            _adopt_stage(store, work)
    return removed


def describe(store: Store, plan: Plan, root: str, kinds: Sequence[str]) -> dict[str, Any]:
    """Return dataset.json by schema dataset-1; other variants and kinds that earlier runs made of the same stage stay
    listed."""
    before = read_dataset_json(store.folder) if store.folder.type_of(DESCRIPTION) else None
    if before and same_stage.differences(before, plan):
        before = None
    hashes = dict(before.stage.hashes) if before else {}
    hashes = {name: hash for name, hash in hashes.items() if name in plan.known_variants}
    hashes |= {name: stage.hash for name, stage in plan.stages.items()}
    classes = class_ids(part.class_ for part in plan.content.parts.values())
    description = DatasetDescription(
        stage=StageEntry(root=root, origin=plan.origin, hashes=hashes),
        targets=plan.content.targets,
        parts=plan.content.parts,
        classes={str(number): name for name, number in classes.items()},
        variants=list(hashes),
        frames=len(plan.names),
        files={kind: MEANINGS[kind] for kind in FILE_KINDS if kind in kinds or (before and kind in before.files)},
    )
    described: dict[str, Any] = to_builtins(description)
    return described


def _remove_unwanted(store: Store, planned: Plan, options: RunOptions) -> int:
    """Remove pictures of other stages, and return how many.

    With `replace` all pictures of another stage go; with either, pictures that the stage does not have. Raises
    InputError if there are some and the option is not given.
    """
    other = same_stage.other_origin(store, planned)
    if other:
        if not options.replace:
            same_stage.refuse(store, other)
        unwanted = list(store.records())
    else:
        unwanted = orphans.orphaned_pictures(store, planned)
        if not (options.prune or options.replace):
            orphans.refuse(store, unwanted)
    orphans.remove(store, unwanted)
    return len(unwanted)


def _adopt_stage(store: Store, work: Path) -> None:
    """Put the copied stage in its place, unless the same is there, which others may be reading; the old one is removed
    with the work folder."""
    try:
        write_sums(work / STAGE)
        if same_files(work / STAGE, store.stage) and same_names(work / STAGE, store.stage):
            return
        force_folder(work / STAGE)
        with suppress(FileNotFoundError):
            put(Folder(work), store.stage, "old")
        put(store.folder, work / STAGE, STAGE)
    except OSError as e:
        raise OutputError(f"cannot be written ({e.strerror})", where=store.stage, do="free some space") from e

"""A stage to a dataset: plan, skip what is finished, supervise the workers. Run again, it resumes."""

import time
from pathlib import Path

from spin_usd.dataset.plan.picture_timeout import refuse_time_limit
from spin_usd.dataset.process.open_renderer import ANOTHER_RENDERER, require_renderer
from spin_usd.dataset.process.processors import refuse_workers
from spin_usd.dataset.render.destination import opened
from spin_usd.dataset.render.report import RenderReport
from spin_usd.dataset.render.request import RenderRequest
from spin_usd.dataset.render.run import DatasetOptions, DatasetRun
from spin_usd.dataset.shards.manifest import remove_finished_manifest
from spin_usd.dataset.shards.shard import Shard
from spin_usd.dataset.store.cache import remove_entries, used
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.errors import InputError
from spin_usd.files.url import is_url
from spin_usd.progress import Note, Progress, unsaid
from spin_usd.scene.effort import CPU


def render(
    request: RenderRequest,
    out: str | Path,
    *,
    cluster: str | None = None,
    workers: int | None = None,
    keep_cache: bool = True,
    prune: bool = False,
    replace: bool = False,
    verify: bool = False,
    shard: Shard | None = None,
    picture_timeout: float | None = None,
    only: frozenset[str] | None = None,
    progress: Progress,
    note: Note = unsaid,
) -> RenderReport:
    """Make the dataset in the folder or at the URL `out`, or what is missing of it, here or on the Ray cluster at that
    address; of a `shard` its own pictures alone.

    Once nothing is missing, the cache loses what no record uses any more; without `keep_cache` it loses everything, and
    renders that only one picture needs are not kept in the first place. Pictures that the stage does not have raise
    InputError, or are removed with `prune`; those of another stage raise it too, or are all removed with `replace`,
    whatever part of this one is wanted. With `verify` pictures whose files are not as their records say are made again.
    A worker that takes longer than `picture_timeout` seconds for a picture is replaced; that follows the picture's
    expected time where it is not given. The first signal that asks to stop lets running pictures be finished, as `note`
    is told; a second stops the run at once. With `only` nothing but the pictures of these names is made, and those are
    made whatever their records say.
    """
    began = time.monotonic()
    refuse_time_limit(picture_timeout)
    if shard and cluster is not None:
        do = "give one of them: a cluster shares out all pictures by itself"
        raise InputError("--shard and --cluster are given together", do=do)
    if cluster is not None and request.device != CPU:
        do = "leave --device out: the workers of a cluster render on processors"
        raise InputError("--device and --cluster are given together", do=do)
    if workers is not None:
        refuse_workers(workers)
    if request.renders:
        require_renderer(request.renderer, instead=ANOTHER_RENDERER)
    options = DatasetOptions(
        workers=workers,
        keep_cache=keep_cache and not is_url(out),
        prune=prune,
        replace=replace,
        verify=verify,
        shard=shard,
        picture_timeout=picture_timeout,
        only=only,
    )
    if is_url(out) and (verify or shard):
        option, do = ("--verify", "fetch it") if verify else ("--shard", "make the shards in folders, and merge them")
        raise InputError(f"is a URL, where {option} is not possible", where=out, do=do)
    with opened(out, cluster) as destination:
        store = destination.store
        store.prepare(strange_stays=only is not None)  # a repair leaves it where it is
        with store.locked(shard.name if shard else None) as lease:
            report = DatasetRun(destination, lease, request, options, progress, note).complete()
            if not report.failed and shard is None and not destination.mirror:  # others may be using the cache
                _tidy(store, report, keep_cache)
                remove_finished_manifest(store)
    report.seconds = time.monotonic() - began
    return report


def _tidy(store: Store, report: RenderReport, keep_cache: bool) -> None:
    """Remove from the cache what no record uses; where no picture was made or removed, none has ceased to be
    used."""
    if not keep_cache:
        remove_entries(store, but=set())
    elif report.made or report.pruned:
        remove_entries(store, but=used(store))

"""A stage to a dataset: plan, skip finished pictures, supervise the workers. Another run resumes."""

import time
from pathlib import Path

from spin_usd.basics.extras import EXTRAS
from spin_usd.basics.progress import Note, Progress, no_note
from spin_usd.commands.render.dataset_run import DatasetRun
from spin_usd.commands.render.destination import opened
from spin_usd.commands.render.options import RenderOptions
from spin_usd.commands.render.render_run import RenderRun
from spin_usd.commands.render.report import RenderReport
from spin_usd.errors import InputError
from spin_usd.files.url import is_url
from spin_usd.options import RunOptions, takes
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.shard import Shard, remove_manifest
from spin_usd.processes.open_renderer import ANOTHER_RENDERER, require_renderer
from spin_usd.scene.effort import CPU
from spin_usd.store.cache import remove_entries, used
from spin_usd.store.dataset_folder import Store


@takes(RenderOptions)
def render(options: RenderOptions) -> RenderReport:
    """Render and label a stage into a dataset. Another run makes the missing pictures.

    Failed pictures do not raise: the report's `failed` lists their names and reasons. Ctrl-C lets running pictures
    finish, with a note by `on_note`, and raises KeyboardInterrupt then; a second one raises it at once.

    Raises InputError, StageError and UnsupportedError if the stage cannot be rendered, and OutputError.
    """
    request = RenderRequest.of(options)
    if options.event_labels and not options.events:
        raise InputError("event_labels is given without events", do="give both")
    labelled = options.event_labels if options.events else None
    return render_dataset(
        request, options.out, options, event_labels=labelled, progress=options.progress, note=options.note
    )


def render_dataset(
    request: RenderRequest,
    out: str | Path,
    options: RunOptions,
    *,
    only: frozenset[str] | None = None,
    event_labels: bool | None = None,
    progress: Progress,
    note: Note = no_note,
) -> RenderReport:
    """Make the dataset in the folder or at the URL `out`, or its missing pictures, by the `options`; and the events of
    each variant, unless `event_labels` is None, with their labels if it is true.

    Once nothing is missing, the cache loses files that no record uses any more; with `no_cache` it loses everything,
    and never stores renders that only one picture needs. With `only`, just the pictures of these names are made,
    whatever their records contain. The first signal to stop lets running pictures finish, with a note; a second stops
    the run at once. Raises InputError and OutputError.
    """
    began = time.monotonic()
    shard = None if options.shard is None else Shard.parse(options.shard)
    if shard and options.cluster is not None:
        do = "give one of them: a cluster shares out all pictures by itself"
        raise InputError("--shard and --cluster are given together", do=do)
    if event_labels is not None:
        EXTRAS["events"].require(but="faery")
    if event_labels is not None and (shard or options.cluster is not None or is_url(out)):
        do = "render events into a folder of this machine, a variant at a time where there are several machines"
        raise InputError("events are requested with a shard, a cluster or a URL", do=do)
    if options.cluster is not None and request.device != CPU:
        do = "leave --device out: the workers of a cluster render on processors"
        raise InputError("--device and --cluster are given together", do=do)
    if request.renders:
        require_renderer(request.renderer, instead=ANOTHER_RENDERER)
    if is_url(out) and (options.verify or shard):
        option, do = (
            ("--verify", "fetch it") if options.verify else ("--shard", "make the shards in folders, and merge them")
        )
        raise InputError(f"is a URL, where {option} is not possible", where=out, do=do)
    with opened(out, options.cluster) as destination:
        store = destination.store
        store.prepare(special_files_stay=only is not None)  # a repair leaves them in place
        with store.locked() as lease:
            run = RenderRun(
                destination=destination,
                lease=lease,
                request=request,
                options=options,
                shard=shard,
                only=only,
                event_labels=event_labels,
                progress=progress,
                note=note,
            )
            report = DatasetRun(run).complete()
            if not report.failed and not destination.mirror:
                _tidy(store, report, keep=not options.no_cache)
                if shard is None and only is None:  # a whole run now, not one of several shards
                    remove_manifest(store)
    report.seconds = time.monotonic() - began
    return report


def _tidy(store: Store, report: RenderReport, *, keep: bool) -> None:
    """Remove files that no record uses from the cache; they exist only if a picture was made or removed."""
    if not keep:
        remove_entries(store, but=set())
    elif report.made or report.pruned or report.events:
        remove_entries(store, but=used(store))

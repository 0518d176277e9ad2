"""A stage to a dataset: plan, skip what is finished, supervise the workers. Run again, it resumes."""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import psutil

from spin_usd.dataset.picture.brightness import WORDS, faults
from spin_usd.dataset.picture.make_picture import IMAGE, KINDS, RADIANCE
from spin_usd.dataset.picture.planned_picture import PlannedPicture
from spin_usd.dataset.plan.cost import Timings, expected_work, write_measured
from spin_usd.dataset.plan.effort_choice import Chosen, doubts
from spin_usd.dataset.plan.make_plan import Plan, Question, make_plan
from spin_usd.dataset.plan.wall_time import one_core
from spin_usd.dataset.plan.work import RunOptions, Task
from spin_usd.dataset.process.child import Child
from spin_usd.dataset.process.open_renderer import DEFAULT_RENDERER, renderer_entry, require_renderer
from spin_usd.dataset.process.processors import share_of, usable_cpus
from spin_usd.dataset.render import same_stage
from spin_usd.dataset.render.dataset_json import describe
from spin_usd.dataset.render.orphans import orphaned_pictures, refuse, remove
from spin_usd.dataset.render.supervise import supervise
from spin_usd.dataset.render.task_queue import RenderTask
from spin_usd.dataset.render.worker_options import WorkerOptions
from spin_usd.dataset.store.atomic import write_json
from spin_usd.dataset.store.cache import MEASURED, remove_entries, used
from spin_usd.dataset.store.dataset_folder import Lease, Store
from spin_usd.dataset.store.file_digests import refuse_changed, write_sums
from spin_usd.dataset.store.names import STAGE
from spin_usd.dataset.store.unfinished import WantedFiles, kinds_left
from spin_usd.errors import InputError, OutputError
from spin_usd.labels.table import DEFAULT_LABELS, LABELS
from spin_usd.progress import Progress
from spin_usd.scene.effort import Effort

MEMORY_PER_WORKER = 1 << 30  # bytes a worker is expected to need at the most; 300-400 MB is usual
IMAGE_SUFFIXES = (".png", ".jpg")


@dataclass(frozen=True, kw_only=True)
class RenderRequest:
    """What the user asked of `render` or `plan`. chosen: why the effort is what it is, where it was not given."""

    stage: Path
    frames: str | None = None
    variants: tuple[str, ...] = ()
    effort: Effort = Effort()  # noqa: RUF009 - frozen
    chosen: Chosen | None = None
    seed: int | None = None
    renderer: str = DEFAULT_RENDERER
    labels: tuple[str, ...] = DEFAULT_LABELS
    image: bool = True
    radiance: bool = False
    image_suffix: str = ".png"

    def __post_init__(self) -> None:
        for label in self.labels:
            if label not in LABELS:
                raise InputError(f"there is no label {label!r}", do=f"choose among {', '.join(LABELS)}")
        heeded = renderer_entry(self.renderer).effort
        if unused := set(self.effort.unusual) - heeded:
            found = f"{self.renderer} has no {' and no '.join(sorted(unused))}"
            raise InputError(found, where=self.effort.text, do=f"give it only {' and '.join(sorted(heeded))}")
        if self.image_suffix not in IMAGE_SUFFIXES:
            raise InputError(f"images cannot be {self.image_suffix!r}", do=f"choose {' or '.join(IMAGE_SUFFIXES)}")
        if not self.kinds:
            raise InputError("no file is asked for", do="ask for labels, the image, or both")

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of file wanted of each picture."""
        wanted = {*self.labels, *([IMAGE] if self.image else []), *([RADIANCE] if self.radiance else [])}
        return tuple(kind for kind in KINDS if kind in wanted)


@dataclass(kw_only=True)
class RenderReport:
    """What a run did. `reused`: pictures that were there already; `pruned`: pictures removed, which the stage does not
    have or which were another stage's. Of the pictures made, so many took a label pass (`label_passes`) and a render
    (`renders`) of their own, and so many shared another's from the cache. `seconds`: wall-clock; `work`: seconds by
    kind of work, over all workers; `doubts`: about the choice of the effort. `faults`: how many pictures, made or there
    already, have each of those that dataset.tones knows."""

    pictures: int
    made: int = 0
    reused: int = 0
    pruned: int = 0
    label_passes: int = 0
    labels_shared: int = 0
    renders: int = 0
    renders_shared: int = 0
    failed: list[tuple[str, str]] = field(default_factory=list)
    seconds: float = 0.0
    work: dict[str, float] = field(default_factory=dict)
    doubts: list[str] = field(default_factory=list)
    faults: dict[str, int] = field(default_factory=lambda: dict.fromkeys(WORDS, 0))

    def add(self, faults: Iterable[str]) -> None:
        """Count those of one more picture."""
        for fault in faults:
            self.faults[fault] += 1


def plan(request: RenderRequest, *, progress: Progress, explain: bool = False) -> Plan:
    """What a run would make; writes nothing. With `explain` also what it leaves out, and why."""
    return _plan(request, None, progress, explain=explain)


def run_options(request: RenderRequest, plan: Plan) -> RunOptions:
    """How all pictures of the run are made."""
    width, height = plan.description["camera"]
    return RunOptions(
        renderer=request.renderer, effort=request.effort, kinds=request.kinds, frame_pixels=width * height
    )


def render(
    request: RenderRequest,
    out: Path,
    *,
    workers: int | None = None,
    keep_cache: bool = True,
    prune: bool = False,
    replace: bool = False,
    verify: bool = False,
    progress: Progress,
) -> RenderReport:
    """Make the dataset in the folder `out`, or what is missing of it.

    Once nothing is missing, the cache loses what no record uses any more; without `keep_cache` it loses everything, and
    renders that only one picture needs are not kept in the first place. Pictures that the stage does not have raise
    InputError, or are removed with `prune`; those of another stage raise it too, or are all removed with `replace`,
    whatever part of this one is wanted. With `verify` pictures whose files are not as their records say are made again.
    """
    began = time.monotonic()
    store = Store(root=out.absolute())
    if not request.stage.exists():
        raise InputError("does not exist", where=request.stage, do="make a stage with spin-usd author")
    require_renderer(request.renderer)
    store.prepare()
    with store.locked() as lease:
        options = _RunOptions(workers=workers, keep_cache=keep_cache, prune=prune, replace=replace, verify=verify)
        report = _render(store, lease, request, options, progress)
        if not report.failed:
            _tidy(store, report, keep_cache)
    report.seconds = time.monotonic() - began
    return report


@dataclass(frozen=True, kw_only=True)
class _RunOptions:
    """What `render` is told of the run, by its own names."""

    workers: int | None
    keep_cache: bool
    prune: bool
    replace: bool
    verify: bool


def _render(
    store: Store, lease: Lease, request: RenderRequest, options: _RunOptions, progress: Progress
) -> RenderReport:
    own = request.stage.resolve().is_relative_to(store.stage.resolve())  # the dataset's own copy, perhaps edited
    copied = store.stage.resolve() if own else lease.work / STAGE
    plan = _plan(request, None if own else copied, progress)
    pictures = plan.pictures
    if not own:
        refuse_changed(store.stage)
    root = (Path(STAGE) / plan.root.relative_to(copied)).as_posix()
    removed = _remove_unwanted(store, plan, options)
    write_json(store.description, describe(store, plan, root, request.kinds), work=lease.work)
    if not own:
        _adopt_stage(store, lease.work)
    report = RenderReport(pictures=len(pictures), pruned=removed, doubts=doubts(request.chosen, plan.stages))
    stages = {variant: {"root": root, **stage} for variant, stage in plan.stages.items()}
    wanted = WantedFiles(kinds=request.kinds, image_suffix=request.image_suffix, verify=options.verify)
    left = partial(
        kinds_left,
        store,
        wanted=wanted,
        target=plan.description["target"],
        finished=lambda each: report.add(faults(each)),
        work=lease.work,
    )
    kinds = ((picture, left(picture, stage=stages[picture.variant])) for picture in pictures)
    tasks = [RenderTask(picture=picture, kinds=missing) for picture, missing in kinds if missing]
    report.reused = len(pictures) - len(tasks)
    if tasks:
        if not options.keep_cache:
            _keep_only_shared_renders(tasks)
        for_workers = WorkerOptions(
            root=str(store.root),
            work=str(lease.work),
            stage=root,
            image_suffix=request.image_suffix,
            settings=plan.settings,
            chosen=request.chosen,
        )
        count = min(options.workers or default_workers(), len(tasks))
        alone = partial(one_core, workers=count, cores=len(usable_cpus()))
        listener = _Listener(report, progress, run_options(request, plan), alone)
        _run(for_workers, tasks, count, lease, listener)
        if report.made:
            write_measured(store.cache / MEASURED, listener.measured, work=lease.work)
    return report


def _remove_unwanted(store: Store, plan: Plan, options: _RunOptions) -> int:
    """Remove, where that was told, all pictures of another stage, else those that the stage does not have; how many.
    Raises InputError where it was not told."""
    other = same_stage.other_origin(store, plan)
    if not options.replace:
        same_stage.refuse(store, other)
    unwanted = list(store.records()) if other else orphaned_pictures(store, plan)
    (remove if other or options.prune else refuse)(store, unwanted)
    return len(unwanted)


def _keep_only_shared_renders(tasks: list[RenderTask]) -> None:
    wanted = Counter(task.picture.radiance for task in tasks if task.renders)
    for task in tasks:
        task.keep_render = wanted[task.picture.radiance] > 1


def _tidy(store: Store, report: RenderReport, keep_cache: bool) -> None:
    """Remove from the cache what no record uses; where no picture was made or removed, none has ceased to be
    used."""
    if not keep_cache:
        remove_entries(store, but=set())
    elif report.made or report.pruned:
        remove_entries(store, but=used(store))


class _Listener:
    """Counts what was done, and measures it: the picture, beside what was expected of it. `alone`: a worker's seconds
    by kind of work to those of one core."""

    def __init__(
        self,
        report: RenderReport,
        progress: Progress,
        method: RunOptions,
        alone: Callable[[Mapping[str, float]], Mapping[str, float]],
    ) -> None:
        self.report, self.progress, self.method, self.alone = report, progress, method, alone
        self.measured = Timings()

    def ready(self) -> None:
        self._tell()

    def done(self, picture: PlannedPicture, result: Mapping[str, Any]) -> None:
        self.report.made += 1
        self.report.add(result["faults"])
        match result["passes"].get("labels"):
            case "made":
                self.report.label_passes += 1
            case "shared":
                self.report.labels_shared += 1
        match result["passes"].get("render"):
            case "made":
                self.report.renders += 1
            case "shared":
                self.report.renders_shared += 1
        own = {name: result["passes"].get(name) == "made" for name in ("labels", "render")}
        making = Task(picture=picture, label_pass=own["labels"], render=own["render"])
        self.measured.add(expected_work(making, self.method), self.alone(result["seconds"]))
        for work, seconds in result["seconds"].items():
            self.report.work[work] = self.report.work.get(work, 0.0) + seconds
        self._tell()

    def failed(self, picture: PlannedPicture, reason: str) -> None:
        self.report.failed.append((picture.name, reason))
        self._tell()

    def _tell(self) -> None:
        report = self.report
        self.progress("rendering: picture", report.reused + report.made + len(report.failed), report.pictures)


def _plan(request: RenderRequest, copy_to: Path | None, progress: Progress, *, explain: bool = False) -> Plan:
    question = Question(
        stage=request.stage,
        variants=request.variants,
        frames=request.frames,
        renderer=request.renderer,
        effort=request.effort,
        seed=request.seed,
        image_suffix=request.image_suffix if request.image else None,
        copy_to=copy_to,
        explain=explain,
    )
    return make_plan(question, processes=len(usable_cpus()), progress=progress)


def _run(options: WorkerOptions, tasks: list[RenderTask], workers: int, lease: Lease, listener: _Listener) -> None:
    def start(number: int) -> Child:
        listener.progress(f"starting {options.settings.renderer}: worker", number + 1, workers)
        child = Child(keep_open=(lease.descriptor,), scratch=lease.work)
        child.send("open_worker", options=options.as_json(), cpus=share_of(number, workers))
        return child

    memory_limit = max(psutil.virtual_memory().total // 2 // workers, MEMORY_PER_WORKER)
    supervise(tasks, workers=workers, start=start, listener=listener, memory_limit=memory_limit)


def default_workers() -> int:
    """As many as there are processors and memory for."""
    return max(1, min(len(usable_cpus()), psutil.virtual_memory().available // MEMORY_PER_WORKER))


def _adopt_stage(store: Store, work: Path) -> None:
    """Put the copied stage in its place; the one that was there goes with the work folder."""
    try:
        write_sums(work / STAGE)
        with suppress(FileNotFoundError):
            store.stage.rename(work / "old")
        (work / STAGE).rename(store.stage)
    except OSError as e:
        raise OutputError(f"cannot be written ({e.strerror})", where=store.stage, do="free some space") from e

"""A stage to a dataset: plan, skip what is finished, supervise the workers. Run again, it resumes."""

import os
import shutil
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

from spin_usd.dataset.cache import remove_entries, used
from spin_usd.dataset.child import STAGE_PATIENCE_S, Child, ChildDiedError, stage_memory
from spin_usd.dataset.cost import Estimate, estimate
from spin_usd.dataset.describe import describe, refuse_foreign_pictures
from spin_usd.dataset.job import Job, PlannedPicture
from spin_usd.dataset.picture import IMAGE, KINDS, RADIANCE
from spin_usd.dataset.resume import Wanted, remaining
from spin_usd.dataset.store import TEMPORARY, Store, write_json
from spin_usd.dataset.supervise import Task, supervise
from spin_usd.errors import InputError, SpinError, StageError
from spin_usd.labels.label import LABELS
from spin_usd.scene.keys import RenderSettings

MEMORY_PER_WORKER = 1 << 30  # bytes a worker is expected to need at the most; 300-400 MB is usual
IMAGE_SUFFIXES = (".png", ".jpg")

Progress = Callable[[str, int, int], None]
"""Told what is being done, how many are done and how many there are."""


@dataclass(frozen=True, kw_only=True)
class RenderRequest:
    """What the user asked of `render` or `plan`."""

    stage: Path
    frames: str | None = None
    variants: tuple[str, ...] = ()
    samples: int = 16
    seed: int | None = None
    renderer: str = "blender"
    labels: tuple[str, ...] = tuple(LABELS)
    image: bool = True
    radiance: bool = False
    image_suffix: str = ".png"

    def __post_init__(self) -> None:
        for label in self.labels:
            if label not in LABELS:
                raise InputError(f"there is no label {label!r}", do=f"choose among {', '.join(LABELS)}")
        if not 1 <= self.samples <= 1 << 20:
            raise InputError(f"--samples is {self.samples}", do="choose 1 to 1048576")
        if self.renderer not in ("blender", "raycast"):
            raise InputError(f"there is no renderer {self.renderer!r}", do="choose blender or raycast")
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
    """What a run did. `reused`: pictures that were there already. Of the pictures made, so many took a label pass
    (`label_passes`) and a render (`renders`) of their own, and so many shared another's from the cache. `seconds`:
    wall-clock; `work`: seconds by kind of work, over all workers."""

    pictures: int
    made: int = 0
    reused: int = 0
    label_passes: int = 0
    labels_shared: int = 0
    renders: int = 0
    renders_shared: int = 0
    failed: list[tuple[str, str]] = field(default_factory=list)
    seconds: float = 0.0
    work: dict[str, float] = field(default_factory=dict)


def plan(request: RenderRequest, *, progress: Progress) -> tuple[Mapping[str, Any], list[PlannedPicture], Estimate]:
    """What a run would make and about what it would cost; writes nothing."""
    answer = _plan(request, None, progress)
    pictures = [PlannedPicture.from_json(picture) for picture in answer["pictures"]]
    return answer, pictures, estimate(pictures, answer["description"], request.kinds, request.renderer, request.samples)


def render(
    request: RenderRequest, out: Path, *, workers: int | None = None, keep_cache: bool = True, progress: Progress
) -> RenderReport:
    """Make the dataset in the folder `out`, or what is missing of it.

    Once nothing is missing, the cache loses what no record uses any more; without `keep_cache` it loses everything, and
    renders that only one picture needs are not kept in the first place.
    """
    began = time.monotonic()
    store = Store(root=out.absolute())
    if not request.stage.exists():
        raise InputError("does not exist", where=request.stage, do="make a stage with spin-usd author")
    store.prepare()
    with store.locked() as lock:
        report = _render(store, lock, request, workers, keep_cache, progress)
        if not report.failed:
            _tidy(store, report, keep_cache)
    report.seconds = time.monotonic() - began
    return report


def _render(
    store: Store, lock: int, request: RenderRequest, workers: int | None, keep_cache: bool, progress: Progress
) -> RenderReport:
    own = request.stage.resolve().is_relative_to(store.stage.resolve())  # the dataset's own copy, perhaps edited
    answer = _plan(request, None if own else store.work / "stage", progress)
    pictures = [PlannedPicture.from_json(picture) for picture in answer["pictures"]]
    refuse_foreign_pictures(store, answer)
    copied = store.stage.resolve() if own else store.work / "stage"
    root = (Path(store.stage.name) / Path(answer["root"]).relative_to(copied)).as_posix()
    write_json(store.description, describe(store, answer, root, request.kinds))
    if not own:
        _adopt_stage(store)
    report = RenderReport(pictures=len(pictures))
    stages = {variant: {"root": root, **stage} for variant, stage in answer["stages"].items()}
    wanted = Wanted(kinds=request.kinds, image_suffix=request.image_suffix)
    tasks = [task for picture in pictures if (task := remaining(store, picture, wanted, stages[picture.variant]))]
    report.reused = len(pictures) - len(tasks)
    if tasks:
        if not keep_cache:
            _keep_only_shared_renders(tasks)
        settings = RenderSettings(**answer["settings"])
        job = Job(root=str(store.root), stage=root, image_suffix=request.image_suffix, settings=settings)
        _run(job, tasks, workers, lock, store, _Listener(report, progress))
    return report


def _keep_only_shared_renders(tasks: list[Task]) -> None:
    wanted = Counter(task.picture.radiance for task in tasks if task.renders)
    for task in tasks:
        task.keep_render = wanted[task.picture.radiance] > 1


def _tidy(store: Store, report: RenderReport, keep_cache: bool) -> None:
    """Remove from the cache what no record uses; where no picture was made, none has ceased to be used."""
    if not keep_cache:
        remove_entries(store, but=set())
    elif report.made:
        remove_entries(store, but=used(store))


class _Listener:
    def __init__(self, report: RenderReport, progress: Progress) -> None:
        self.report, self.progress = report, progress
        progress("rendering", report.reused, report.pictures)

    def done(self, picture: PlannedPicture, result: Mapping[str, Any]) -> None:
        self.report.made += 1
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
        for work, seconds in result["seconds"].items():
            self.report.work[work] = self.report.work.get(work, 0.0) + seconds
        self._tell()

    def failed(self, picture: PlannedPicture, reason: str) -> None:
        self.report.failed.append((picture.name, reason))
        self._tell()

    def _tell(self) -> None:
        report = self.report
        self.progress("rendering", report.reused + report.made + len(report.failed), report.pictures)


def _plan(request: RenderRequest, copy_to: Path | None, progress: Progress) -> Mapping[str, Any]:
    """Read the stage in a child of its own: a stage that was made to harm ends that, and nothing else."""
    with Child(memory=stage_memory()) as child:
        try:
            answer: Mapping[str, Any] = child.call(
                "plan",
                stage=str(request.stage.absolute()),
                variants=request.variants,
                frames=request.frames,
                renderer=request.renderer,
                samples=request.samples,
                seed=request.seed,
                image_suffix=request.image_suffix if request.image else None,
                copy_to=str(copy_to) if copy_to else None,
                progress=lambda counts: progress("planning", *counts),
                within_s=STAGE_PATIENCE_S,
            )
        except ChildDiedError as died:
            do = "simplify it, or look for what multiplies in it"
            raise StageError(f"cannot be read: {died.found}", where=request.stage, do=do) from died
        except SpinError as e:
            if copy_to is None or e.where is None:
                raise
            where = str(e.where).replace(str(copy_to), str(request.stage.parent))  # the user's file, not our copy
            raise type(e)(e.found, where=where, do=e.do) from e
    return answer


def _run(job: Job, tasks: list[Task], workers: int | None, lock: int, store: Store, listener: _Listener) -> None:
    cpus = usable_cpus()
    count = min(workers or default_workers(), len(tasks))
    share = max(len(cpus) // count, 1)

    def start(number: int) -> Child:
        child = Child(keep_open=(lock,), scratch=store.work)
        mine = [cpus[(number * share + i) % len(cpus)] for i in range(share)]
        child.send("open_worker", job=job.as_json(), cpus=mine)
        return child

    memory_limit = max(psutil.virtual_memory().total // 2 // count, MEMORY_PER_WORKER)
    supervise(tasks, workers=count, start=start, listener=listener, memory_limit=memory_limit)


def usable_cpus() -> list[int]:
    """The processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


def default_workers() -> int:
    """As many as there are processors and memory for."""
    return max(1, min(len(usable_cpus()), psutil.virtual_memory().available // MEMORY_PER_WORKER))


def _adopt_stage(store: Store) -> None:
    """Put the copied stage in its place."""
    old = store.root / f"stage{TEMPORARY}old"
    with suppress(FileNotFoundError):
        store.stage.rename(old)
    (store.work / "stage").rename(store.stage)
    shutil.rmtree(old, ignore_errors=True)

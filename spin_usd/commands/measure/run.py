"""`spin-usd measure`: what settings cost and how far they are off on a few pictures. Run again, it resumes."""

import json
import os
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from spin_usd.accuracy.measurement import Execution, Failure, Measurement
from spin_usd.accuracy.report import in_full
from spin_usd.accuracy.sweep import STEP, base_effort, representative
from spin_usd.commands.measure.campaign import PART, Campaign, PercentDone, weight
from spin_usd.commands.measure.options import MeasureOptions
from spin_usd.commands.measure.picture_task import PictureTask
from spin_usd.commands.measure.plot import plot
from spin_usd.commands.measure.processes import Job, Processes, ProcessKind
from spin_usd.commands.measure.renders import SUBJECT, RenderStore, is_render_file, render_file
from spin_usd.errors import InputError, RenderError
from spin_usd.files.folder import Folder
from spin_usd.files.node import NodeType
from spin_usd.labels.table import DEFAULT_LABELS
from spin_usd.options import PictureOptions, takes
from spin_usd.picture.kinds import IMAGE
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.picture.versions import library_versions
from spin_usd.planning.make_plan import Plan, make_plan
from spin_usd.planning.request import PlanRequest, RenderRequest
from spin_usd.planning.time_limit import TimeLimits
from spin_usd.planning.work import NOISE, CommonWork
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import rendering_memory
from spin_usd.processes.open_renderer import require_renderer
from spin_usd.processes.processors import machine, share_of, usable_cpus
from spin_usd.scene.effort import MAX_SAMPLES, Effort
from spin_usd.store.atomic import fill_atomically, write_text
from spin_usd.store.dataset_folder import Lease, Store, refuse_special_files
from spin_usd.store.measurement_file import FILE, folder_of, read_measurement
from spin_usd.store.stage_path import existing_stage

RUNS = "runs"
TABLES, PLOT = "measure.md", "measure.svg"


OURS = (FILE, TABLES, PLOT, RUNS)

WITHOUT_NOISE = (
    "the detector has no noise (spin:sensor:gain is 0), so --error auto, which goes by that noise, will not work with "
    'this measurement; --error X will; spin:sensor:gain, a preset or an augmentation\'s camera = "rich" gives it noise'
)
MIN_S = 600.0  # figures of many large renders take minutes, and are not in what a picture is expected to take
TURNS = 2  # renders from one word to the next


@takes(MeasureOptions)
def measure(options: MeasureOptions) -> Measurement:
    """Measure what settings of a render cost and how far they are off, on a few pictures of a stage; needs Blender.

    Writes measure.json, measure.md and measure.svg. Run again with another `count`, `seeds` or the like, it replaces
    the figures, and renders only what is missing. Another stage or variant takes another `out`. `on_note` is called
    before anything is rendered, with what the measurement will not serve for.

    Raises InputError, OutputError, UnsupportedError where Blender is not installed, and RenderError where no picture
    could be measured.
    """
    root = existing_stage(Path(options.stage))
    return measure_stage(options, root, folder_of(root) if options.out is None else Path(options.out))


def measure_stage(request: MeasureOptions, stage: Path, out: Path) -> Measurement:
    """Measure the `stage` into the folder `out`, or what is missing there: writes measure.json, .md and .svg.

    Raises InputError, also where the folder holds a measurement of another stage or variant, OutputError, and
    RenderError where no picture could be measured.
    """
    require_renderer("blender")
    folder = out.absolute()
    _prepare(folder)
    subject = _subject(stage, request.variant, folder)
    with Store(root=folder).locked() as lease:
        runs = RenderStore(root=folder / RUNS, work=lease.work)
        _refuse_another(runs, subject, folder)
        plan = _plan(request, stage, lease.work / "stage")
        pictures = _chosen(plan, stage, request.count)
        if not all(NOISE in picture.features for picture in pictures):
            request.note(WITHOUT_NOISE)
        runs.write_result(SUBJECT, subject)
        starter = partial(_started, plan, runs, lease)
        patience = partial(time_limit, pictures, max_samples=request.max_samples, frame_pixels=_frame_pixels(plan))
        campaign = Campaign(
            request=request,
            runs=runs,
            seed=plan.settings.seed,
            stage=plan.stages[request.variant]["hash"],
            versions=library_versions() | {"bpy": version("bpy")},
            machine=machine(),
            percent_done=PercentDone(request.progress),
            processes=lambda count: Processes(
                count, partial(starter, count), within_s=patience(workers=count, cores=len(usable_cpus()))
            ),
        )
        measurement, keys = _measured(campaign, pictures, request.workers)
        _write(Folder(folder), measurement, lease.work)
        write_report(folder, measurement, work=lease.work)
        runs.remove_all(but=keys | {SUBJECT})
    return measurement


def _measured(campaign: Campaign, pictures: list[PlannedPicture], workers: int) -> tuple[Measurement, set[str]]:
    """Return all that was measured, and the keys of what the next run can use."""
    smallest = min(pictures, key=lambda each: each.region_pixels)
    tasks = [PictureTask(campaign, each, savings=each is smallest) for each in pictures]
    execution = ExecutionTask(campaign, pictures)
    with campaign.processes(workers) as processes:
        parts = [task.measured(processes) for task in tasks]
    failures = [failure for part in parts for failure in part.failures]
    if not any(part.frames for part in parts):
        why = f"no picture could be measured: {failures[-1].what}: {failures[-1].reason}"
        raise RenderError(why, where=failures[-1].frame, do="run spin-usd doctor")
    executions, failed = execution.measured()
    whole = campaign.measurement(
        frames=tuple(chain.from_iterable(part.frames for part in parts)),
        figures=tuple(chain.from_iterable(part.figures for part in parts)),
        labels=tuple(chain.from_iterable(part.labels for part in parts)),
        savings=tuple(chain.from_iterable(part.savings for part in parts)),
        execution=executions,
        failures=(*failures, *failed),
    )
    return whole, execution.keys.union(*(task.keys for task in tasks))


def _prepare(folder: Path) -> None:
    """Look whether a measurement may be written here: writes nothing. Raises InputError where the folder holds anything
    else, or not a measurement, OutputError where it is not a folder."""
    held = Store(root=folder).contents()
    refuse_special_files(Folder(folder), OURS)
    own = held and Folder(folder).type_of(f"{RUNS}/{render_file(SUBJECT)}") is NodeType.FILE
    runs = (name for name in Folder(folder).files(RUNS) if not is_render_file(name.removeprefix(f"{RUNS}/")))
    strays = [*(name for name in held if not own or name not in OURS), *runs]
    if strays:
        raise InputError(f"holds {strays[0]}, which is not of a measurement", where=folder, do="choose an empty folder")


def _subject(stage: Path, variant: str, folder: Path) -> dict[str, str]:
    """Return the name of what is measured: it stays the same when the stage is edited, or moved with the folder."""
    root = os.path.relpath(stage.resolve(), folder.resolve())
    return {"stage": Path(root).as_posix(), "variant": variant}


def _refuse_another(runs: RenderStore, subject: Mapping[str, str], folder: Path) -> None:
    """Raise InputError where the folder holds a measurement of anything but the subject."""
    held = runs.known(SUBJECT) or subject
    if held != subject:
        found = f"holds a measurement of variant {held['variant']} of {held['stage']}"
        raise InputError(found, where=folder, do="give another folder with --out")


def _plan(request: MeasureOptions, stage: Path, copy_to: Path) -> Plan:
    options = PictureOptions(
        stage, variants=request.variant, frames=request.frames, labels="none", labels_only=True, radiance=True
    )
    question = PlanRequest(request=RenderRequest(options=options, effort=Effort()), copy_to=copy_to)
    return make_plan(question, processes=len(usable_cpus()), progress=request.progress)


def _chosen(plan: Plan, stage: Path, count: int) -> list[PlannedPicture]:
    """Choose the pictures to measure. Raises InputError where none shows the target."""
    pixels = {place: picture.region_pixels for place, picture in enumerate(plan.pictures)}
    chosen = representative(pixels, count)
    if not chosen:
        do = "choose others with --frames"
        raise InputError(f"none of the {len(plan.pictures)} pictures shows the target", where=stage, do=do)
    return [plan.pictures[place] for place in chosen]


def _frame_pixels(plan: Plan) -> int:
    width, height = plan.content.camera
    return int(width * height)


def _started(plan: Plan, runs: RenderStore, lease: Lease, count: int, number: int, kind: ProcessKind) -> Child:
    """Start a process of that kind, the `number`th of `count`."""
    child = Child(keep_open=(lease.descriptor,), scratch=lease.work, memory=rendering_memory())
    child.send(
        "open_measuring",
        stage=str(plan.root),
        variant=plan.variants[0],
        folder=str(runs.root),
        work=str(runs.work),
        cpus=share_of(number, count),
        **asdict(kind),
    )
    return child


def _write(folder: Folder, measurement: Measurement, work: Path) -> None:
    """Write the measurement as JSON, which is checked before it is there."""

    def write(temporary: Path) -> None:
        text = json.dumps(to_builtins(measurement), indent=1, allow_nan=False) + "\n"
        temporary.write_text(text, encoding="utf-8")
        read_measurement(temporary)

    fill_atomically(folder, FILE, write, work=work)


def write_report(folder: Path, measurement: Measurement, *, work: Path) -> None:
    """Write both files into `folder`, over what is there. Raises OutputError."""
    shown = f"{in_full(measurement)}\n![Error against CPU seconds]({PLOT})\n"
    for name, text in ((TABLES, shown), (PLOT, plot(measurement))):
        write_text(Folder(folder), name, text, work=work)


def time_limit(
    pictures: Iterable[PlannedPicture], *, max_samples: int, frame_pixels: int, workers: int, cores: int
) -> float:
    """Return seconds: what the longest render of these pictures may take, the slowest setting of `max_samples`."""
    samples = min(TURNS * max(STEP, PART) * max_samples, MAX_SAMPLES)
    effort = Effort(samples=samples, denoiser="high")
    kinds = (IMAGE, *DEFAULT_LABELS)
    options = CommonWork(renderer="blender", effort=effort, kinds=kinds, frame_pixels=frame_pixels)
    limits = TimeLimits(options=options, workers=workers, cores=cores)
    return max(MIN_S, *(limits.of(picture, kinds) for picture in pictures))


@dataclass(frozen=True, kw_only=True)
class ExecutionMode:
    """A way to render: a number of processes that share the processors, with or without the crop to the target."""

    processes: int
    crop: bool

    @property
    def threads(self) -> int:
        return max(len(usable_cpus()) // self.processes, 1)


class ExecutionTask:
    """All pictures of a measurement, with each seed, rendered in each of the ways."""

    def __init__(self, campaign: Campaign, pictures: Sequence[PlannedPicture]) -> None:
        self._campaign = campaign
        effort, seeds = (
            base_effort(campaign.request.max_samples),
            campaign.seeds("setting", range(campaign.request.seeds)),
        )
        ordered = sorted(pictures, key=lambda each: -each.region_pixels)  # the long ones first: none is waited for
        self._largest = ordered[0].frame
        self._renders = [
            {"index": picture.index, "effort": asdict(effort), "seed": seed} for picture in ordered for seed in seeds
        ]
        ways = (
            ExecutionMode(processes=n, crop=crop) for n, crop in ((1, True), (len(usable_cpus()), True), (1, False))
        )
        radiance = [picture.radiance for picture in ordered]
        self._keys = {way: campaign.result_key("execution", asdict(way), radiance, self._renders) for way in ways}
        campaign.percent_done.expect(
            dict.fromkeys(self._keys.values(), len(seeds) * sum(weight(picture, effort) for picture in ordered))
        )

    @property
    def keys(self) -> set[str]:
        """Keys of all results that are kept of it."""
        return set(self._keys.values())

    def measured(self) -> tuple[tuple[Execution, ...], tuple[Failure, ...]]:
        """Return what each way took, and the ways that failed."""
        made, failures = {}, []
        for way, key in self._keys.items():
            known = self._campaign.runs.known(key) or self._run(way)
            self._campaign.percent_done.did([key])
            if "failed" in known:
                what = f"{way.processes} processes of {way.threads} threads{'' if way.crop else ' without the crop'}"
                failures.append(Failure(frame=self._largest, what=what, reason=known["failed"]))
            else:
                self._campaign.runs.write_result(key, known)
                made[way] = known
        first = next(iter(made.values()), {})
        executions = (
            Execution(
                processes=way.processes,
                threads=way.threads,
                crop=way.crop,
                wall_s=each["wall_s"],
                same=each["digests"] == first["digests"],
            )
            for way, each in made.items()
        )
        return tuple(executions), tuple(failures)

    def _run(self, way: ExecutionMode) -> dict[str, Any]:
        """Render in that way. Return seconds of wall clock and each render's digest, or why it failed."""
        kind = ProcessKind(renderer="blender", crop=way.crop)
        jobs = [Job(kind=kind, what="render_digest", arguments=each) for each in self._renders]
        with self._campaign.processes(way.processes) as processes:
            processes.run(jobs[-1:] * way.processes)  # opens each
            began = time.perf_counter()
            answers = processes.run(jobs)
            wall_s = time.perf_counter() - began
        failed = [answer.failed for answer in answers if answer.failed is not None]
        return {"failed": failed[0]} if failed else {"wall_s": wall_s, "digests": [each.result for each in answers]}

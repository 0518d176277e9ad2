"""`spin-usd measure`: cost and error of render settings on a few pictures. Another run resumes."""

from functools import partial
from importlib.metadata import version
from itertools import chain
from pathlib import Path

from spin_usd.accuracy.measurement import Measurement
from spin_usd.commands.measure.campaign import Campaign, PercentDone
from spin_usd.commands.measure.execution_task import ExecutionTask
from spin_usd.commands.measure.measured_pictures import (
    WITHOUT_NOISE,
    all_noisy,
    choose,
    frame_pixels,
    plan_measured,
    time_limit,
)
from spin_usd.commands.measure.measurement_folder import (
    RUNS,
    prepare,
    refuse_another,
    subject_of,
    write_measurement,
    write_report,
)
from spin_usd.commands.measure.options import MeasureOptions
from spin_usd.commands.measure.picture_task import PictureTask
from spin_usd.commands.measure.processes import Processes, start_process
from spin_usd.commands.measure.renders import SUBJECT, RenderStore
from spin_usd.errors import RenderError
from spin_usd.files.folder import Folder
from spin_usd.options import takes
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.picture.versions import library_versions
from spin_usd.processes.open_renderer import require_renderer
from spin_usd.processes.processors import machine, usable_cpus
from spin_usd.store.dataset_folder import Store
from spin_usd.store.measurement_file import folder_of
from spin_usd.store.stage_path import existing_stage


@takes(MeasureOptions)
def measure(options: MeasureOptions) -> Measurement:
    """Measure the cost and the error of render settings on a few pictures of a stage; needs Blender.

    Writes measure.json, measure.md and measure.svg. Another run with another `count`, `seeds` or the like replaces the
    figures, and renders only missing pictures. Another stage or variant needs another `out`. `on_note` is called before
    anything is rendered, with the uses that the measurement will not serve.

    Raises InputError, OutputError, UnsupportedError if Blender is not installed, and RenderError if no picture could be
    measured.
    """
    root = existing_stage(Path(options.stage))
    return measure_stage(options, root, folder_of(root) if options.out is None else Path(options.out))


def measure_stage(request: MeasureOptions, stage: Path, out: Path) -> Measurement:
    """Measure the `stage` into the folder `out`, or the missing parts: write measure.json, .md and .svg.

    Raises InputError, also if the folder contains a measurement of another stage or variant, OutputError, and
    RenderError if no picture could be measured.
    """
    require_renderer("blender")
    folder = out.absolute()
    prepare(folder)
    subject = subject_of(stage, request.variant, folder)
    with Store(root=folder).locked() as lease:
        runs = RenderStore(root=folder / RUNS, work=lease.work)
        refuse_another(runs, subject, folder)
        plan = plan_measured(request, stage, lease.work / "stage")
        pictures = choose(plan, stage, request.count)
        if not all_noisy(pictures):
            request.note(WITHOUT_NOISE)
        runs.write_result(SUBJECT, subject)
        starter = partial(start_process, plan, runs, lease)
        patience = partial(time_limit, pictures, max_samples=request.max_samples, frame_pixels=frame_pixels(plan))
        campaign = Campaign(
            request=request,
            runs=runs,
            seed=plan.settings.seed,
            stage=plan.stages[request.variant].hash,
            versions=library_versions() | {"bpy": version("bpy")},
            machine=machine(),
            percent_done=PercentDone(request.progress),
            processes=lambda count: Processes(
                count, partial(starter, count), within_s=patience(workers=count, cores=len(usable_cpus()))
            ),
        )
        measurement, keys = _measured(campaign, pictures, request.workers)
        write_measurement(Folder(folder), measurement, lease.work)
        write_report(folder, measurement, work=lease.work)
        runs.remove_all(but=keys | {SUBJECT})
    return measurement


def _measured(campaign: Campaign, pictures: list[PlannedPicture], workers: int) -> tuple[Measurement, set[str]]:
    """Return all results, and the keys that the next run can use."""
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

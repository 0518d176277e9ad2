"""The missing pictures of a plan, and the reasons why some existing ones are made again."""

from collections import Counter
from functools import partial

from msgspec import structs

from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.render.render_run import RenderRun
from spin_usd.commands.render.report import RenderReport
from spin_usd.commands.render.task_queue import RenderTask
from spin_usd.picture.brightness import faults
from spin_usd.picture.kinds import RENDERED
from spin_usd.planning.make_plan import Plan
from spin_usd.records.record import Record, StageProvenance
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.store.pictures_left import WantedFiles, kinds_left

OTHER_OPTIONS = "made with other options"
OTHER_STAGE = "made from another state of the stage"
OTHER_SOFTWARE = "made by another version of spin_usd"


def wanted_files(run: RenderRun, kinds: tuple[str, ...]) -> WantedFiles:
    """Return the wanted files of each picture, of these kinds."""
    return WantedFiles(
        kinds=kinds,
        options=run.request.options.recorded,
        image_suffix=run.request.image_suffix,
        verify=run.options.verify,
        again=run.only,
    )


def unfinished_tasks(
    run: RenderRun, planned: Plan, root: str, wanted: WantedFiles, report: RenderReport
) -> list[RenderTask]:
    """Return the tasks for the missing pictures of the plan, whose root layer in the dataset is `root`; the report
    counts the others."""
    stages = {variant: structs.replace(stage, root=root) for variant, stage in planned.stages.items()}
    again = Counter[str]()
    left = partial(
        kinds_left,
        run.store,
        wanted=wanted,
        names={target.id: target.name for target in planned.content.targets},
        finished=lambda record: report.add(faults(record)),
        outdated=lambda record, stage: again.update([why_outdated(record, planned.settings, stage)]),
        work=run.lease.work,
    )
    missing = ((picture, left(picture, stage=stages[picture.variant])) for picture in planned.pictures)
    tasks = [RenderTask(picture=picture, kinds=kinds) for picture, kinds in missing if kinds]
    report.reused = len(planned.pictures) - len(tasks)
    for why, count in again.items():
        run.note(f"{pluralise(count, 'picture')} of the dataset, {why}, will be made again")
    return tasks


def why_outdated(record: Record, settings: RenderSettings, stage: StageProvenance) -> str:
    """Return the first of options, stage and software that differs between a picture's `record` and a record with other
    keys, these settings and this `stage`."""
    if RENDERED & record.files.keys() and record.settings != settings:
        return OTHER_OPTIONS
    return OTHER_SOFTWARE if record.provenance.stage == stage else OTHER_STAGE

"""What is left to make of planned pictures, and why pictures that a dataset has are made again."""

from collections import Counter
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from spin_usd.commands.render.report import RenderReport
from spin_usd.commands.render.task_queue import RenderTask
from spin_usd.counted import counted
from spin_usd.errors import InputError
from spin_usd.picture.brightness import faults
from spin_usd.picture.make_picture import RENDERED
from spin_usd.planning.make_plan import Plan
from spin_usd.progress import Note
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.store.dataset_folder import Store
from spin_usd.store.recorded_settings import recorded_settings
from spin_usd.store.unfinished import WantedFiles, kinds_left

OTHER_OPTIONS = "made with other options"
OTHER_STAGE = "made from another state of the stage"
OTHER_SOFTWARE = "made by another version of spin_usd"


def unfinished_tasks(
    store: Store, planned: Plan, root: str, wanted: WantedFiles, *, report: RenderReport, note: Note, work: Path
) -> list[RenderTask]:
    """Return what is left to make of the planned pictures, whose root layer is `root` in the dataset; the report counts
    the others. `note` is given a sentence on pictures that are made again; `work` is for temporary files."""
    stages = {variant: {"root": root, **stage} for variant, stage in planned.stages.items()}
    again = Counter[str]()
    left = partial(
        kinds_left,
        store,
        wanted=wanted,
        names={target["id"]: target["name"] for target in planned.description["targets"]},
        finished=lambda record: report.add(faults(record)),
        outdated=lambda record, stage: again.update([why_outdated(record, planned.settings, stage)]),
        work=work,
    )
    missing = ((picture, left(picture, stage=stages[picture.variant])) for picture in planned.pictures)
    tasks = [RenderTask(picture=picture, kinds=kinds) for picture, kinds in missing if kinds]
    report.reused = len(planned.pictures) - len(tasks)
    for why, count in again.items():
        note(f"{counted(count, 'picture')} of the dataset, {why}, will be made again")
    return tasks


def why_outdated(record: Mapping[str, Any], settings: RenderSettings, stage: Mapping[str, Any]) -> str:
    """Say which of options, stage and software is another for the picture of a `record` than for one with other keys,
    of these settings and this `stage` (a record's own block): the first that is."""
    try:
        if RENDERED & record["files"].keys() and recorded_settings(record) != settings:
            return OTHER_OPTIONS
        return OTHER_SOFTWARE if record["provenance"]["stage"] == stage else OTHER_STAGE
    except (KeyError, TypeError, InputError):  # it has, say, a setting that there is no more
        return OTHER_SOFTWARE

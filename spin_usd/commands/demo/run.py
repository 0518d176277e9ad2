"""The example, end to end: authors a stage, renders and labels it, and lays out a contact sheet."""

from dataclasses import dataclass
from pathlib import Path

from spin_usd.basics import resources
from spin_usd.basics.progress import Note, Progress, no_note
from spin_usd.commands.author.reports import AUTHOR
from spin_usd.commands.render.report import RenderReport
from spin_usd.commands.render.run import render_dataset
from spin_usd.errors import InputError
from spin_usd.options import EffortOptions, PictureOptions, RunOptions
from spin_usd.planning.effort_choice import setting_of
from spin_usd.planning.plan_calls import OPEN_PLAN
from spin_usd.planning.request import RenderRequest
from spin_usd.processes.ask_child import unreadable
from spin_usd.processes.child_ahead import hand_on, next_child
from spin_usd.processes.child_limits import PATIENCE_S
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.reading.contact_sheet import write_contact_sheet
from spin_usd.reading.dataset import Dataset

POSES = "tango_speedplus_poses.json"


@dataclass(frozen=True, kw_only=True)
class Demo:
    """The places where the demo put its results, and the report of its render."""

    stage: Path
    dataset: Path
    contact_sheet: Path
    report: RenderReport


def run_demo(
    out: Path, *, progress: Progress, note: Note = no_note, workers: int | None = None, quality: str | None = None
) -> Demo:
    """Make the example in the folder `out` with a `quality`, the default of renders if None; results of an earlier run
    are used again. Raises InputError for an unknown quality."""
    stage = out / "stage" / "dataset.usda"
    setting_of(stage, EffortOptions(quality=quality), renderer=None)  # a wrong name is reported before anything is made
    if not stage.exists():
        if out.exists() and not (out.is_dir() and not any(out.iterdir())):
            raise InputError("is neither empty nor a demo", where=out, do="choose another folder with --out")
        note("authoring the stage: a target, a camera and poses, as layers of OpenUSD; a few seconds")
        _author(stage.parent)
    dataset, request = out / "dataset", RenderRequest.of(PictureOptions(stage, quality=quality))
    note("planning the pictures and starting Blender; a few seconds")
    report = render_dataset(request, dataset, RunOptions(workers=workers), progress=progress, note=note)
    note("laying out the contact sheet")
    sheet = write_contact_sheet(Dataset(dataset), out / "contact_sheet.png")
    return Demo(stage=stage, dataset=dataset, contact_sheet=sheet, report=report)


def _author(folder: Path) -> None:
    """Author the example's stage in a child, which has loaded USD then, and so is the next that is wanted."""
    poses = resources.stages() / "examples" / POSES
    child, out = next_child(OPEN_PLAN, writes=(folder.parent,)), str(folder.absolute())
    try:
        request = {"poses": str(poses), "target": "tango", "camera": "speedplus", "out": out}
        child.call(AUTHOR, request, within_s=PATIENCE_S)
    except ChildDiedError as died:
        raise unreadable(died, poses) from died
    finally:
        hand_on(child)

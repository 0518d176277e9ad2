"""Compare real pictures with pictures of a stage, measure by measure, and fit light, camera and surface."""

from collections.abc import Sequence
from pathlib import Path

from msgspec import structs

from spin_usd.commands.gap.calls import OPEN_GAP, WRITE_FITS, FittedPair, OpenedGap, OpenGap, WriteFits
from spin_usd.commands.gap.gap_run import FITTING, GapRun
from spin_usd.commands.gap.options import GapOptions
from spin_usd.commands.gap.real_pictures import pairs_in
from spin_usd.commands.gap.report import GapReport
from spin_usd.commands.gap.summary import Step, report_of
from spin_usd.commands.gap.write_preset import refuse_old_preset, write_preset
from spin_usd.files.changes import put, remove_tree
from spin_usd.files.folder import Folder
from spin_usd.options import PictureOptions, takes
from spin_usd.planning.request import RenderRequest
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import rendering_memory
from spin_usd.processes.executor import Executor
from spin_usd.processes.open_renderer import ANOTHER_RENDERER, require_renderer
from spin_usd.processes.processors import share_of, usable_cpus
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import CPU
from spin_usd.store.hidden_folder import hidden_folder
from spin_usd.store.report_folder import refuse_other_files, write_report

DRAFT = "draft"  # enough for the measures, and for fits, which are not denoised
FITTED = "fitted"  # folder of the stage with the fits
REPORT = "gap.json"


@takes(GapOptions)
def gap(options: GapOptions) -> GapReport:
    """Compare a folder of real pictures with a stage of the same poses: black level, noise, sharpness, light on the
    target and on each part, silhouettes, and how well a classifier tells them apart; and fit light, camera and surface.

    The fits are layers over a copy of the stage, which `spin-usd render` renders; the stage itself never changes.

    Raises InputError, StageError, OutputError, and RenderError if no picture could be compared.
    """
    request, out = _request(options), Path(options.out).absolute()
    refuse_other_files(out, REPORT, [FITTED])
    if options.write is not None:
        refuse_old_preset(Path(options.write).absolute())
    settings = RenderSettings(
        renderer=request.renderer, effort=request.effort, seed=options.seed or 0, device=request.devices()[0]
    )
    workers = options.workers or len(usable_cpus())
    with hidden_folder(out.parent, out.name) as hidden:

        def start(number: int) -> Child:
            child = Child(memory=rendering_memory(), modules=(OPEN_GAP.module,), writes=(hidden.folder,))
            cpus = share_of(number, workers)
            child.send(
                OPEN_GAP, OpenGap(stage=str(request.stage), variant=options.variant, settings=settings, cpus=cpus)
            )
            return child

        with Executor[OpenedGap](start, workers=workers, opening=OPEN_GAP) as executor:
            opened = executor.opened_content()
            poses = None if options.poses is None else Path(options.poses)
            pairs, notes = pairs_in(Path(options.real), poses, opened.frames)
            run = GapRun(options=options, executor=executor, pairs={pair.name: pair for pair in pairs})
            run.measure("ours")
            for name in options.fits:
                FITTING[name](run)
                run.measure(name)
            if "light" in options.fits:
                taken = f"numbers of the real pictures are taken as {opened.sensor.encoding}, the stage's encoding"
                notes = [*notes, taken]
            report = report_of(options, run.steps, run.fits, run.left_out, notes)
            if options.fits and all(each.own_pose for each in run.steps[0].pictures.values()):
                _write_fits(run, hidden.folder / FITTED)
                report = structs.replace(report, fitted_stage=f"{options.out}/{FITTED}/dataset.usda")
            elif options.fits:
                left = "the fits are not written: not all pictures have the pose of the stage's frame of their name"
                report = structs.replace(report, notes=[*report.notes, left])
        _write(out, report, run.steps, hidden.folder)
        if options.write is not None:
            fitted = [run.of(picture.name) for picture in report.pictures]
            write_preset(Path(options.write).absolute(), report, opened.sensor, fitted)
    return report


def _request(options: GapOptions) -> RenderRequest:
    """Return the request for our pictures. Raises InputError."""
    given = {name: getattr(options, name) for name in ("samples", "effort", "quality")}
    if options.renderer in (None, "blender") and all(each is None for each in given.values()):
        given["quality"] = DRAFT
    request = RenderRequest.of(
        PictureOptions(stage=options.stage, variants=options.variant, renderer=options.renderer, device=CPU, **given)
    )
    require_renderer(request.renderer, instead=ANOTHER_RENDERER)
    return request


def _write_fits(run: GapRun, folder: Path) -> None:
    """Write the fits as layers over a copy of the stage in `folder`. Raises UnsupportedError, OutputError."""
    pictures = [FittedPair(pair=pair, fitted=run.of(name)) for name, pair in run.pairs.items()]
    values = pictures[0].fitted.values
    asked = WriteFits(folder=str(folder), pictures=pictures, fits=list(run.options.fits), values=values)
    run.executor.call(WRITE_FITS, asked)


def _write(out: Path, report: GapReport, steps: Sequence[Step], work: Path) -> None:
    """Write gap.json and index.html into the folder `out`, and move the fits there from `work`. Raises OutputError."""
    from spin_usd.commands.gap.page import page_of  # not above: matplotlib is slow to load

    write_report(out, REPORT, report, page_of(report, steps), work=work)
    remove_tree(Folder(out), FITTED)
    if (work / FITTED).is_dir():
        put(Folder(out), work / FITTED, FITTED)

"""`spin-usd render`: renders and labels a stage's pictures into a dataset."""

from typing import TYPE_CHECKING, Annotated

import typer

import spin_usd
from spin_usd.cli.arguments import options
from spin_usd.cli.output.failures import exit_if_failed, warn_of_faults
from spin_usd.cli.output.lines import show
from spin_usd.cli.output.notes import show_note, show_notes
from spin_usd.cli.output.progress import shown
from spin_usd.cli.output.report import show_report
from spin_usd.counted import counted
from spin_usd.dataset.plan.picture_timeout import parse_time_limit

if TYPE_CHECKING:
    from spin_usd.dataset.render.report import RenderReport


def render(
    context: typer.Context,
    *,
    stage: options.Stage,
    out: Annotated[
        str,
        typer.Option(metavar="PATH", help="The dataset's folder, or a URL: s3://bucket/name. Run again, it resumes."),
    ],
    frames: options.Frames = None,
    variants: options.Variants = "",
    samples: options.Samples = None,
    effort: options.EffortText = None,
    quality: options.Quality = None,
    error: options.Error = None,
    measured: options.MeasuredIn = None,
    seed: options.Seed = None,
    labels: options.Labels = "default",
    labels_only: options.LabelsOnly = False,
    renderer: options.RendererName = None,
    device: options.DeviceName = "cpu",
    radiance: options.RadianceOption = False,
    image_format: options.ImageFormat = "png",
    workers: options.Workers = None,
    cluster: options.Cluster = None,
    no_cache: options.NoCache = False,
    prune: options.Prune = False,
    replace: options.Replace = False,
    verify: options.Verify = False,
    shard: options.ShardText = None,
    picture_timeout: options.PictureTimeout = None,
    as_json: options.Json = False,
) -> None:
    """Render and label a stage into a dataset."""
    from spin_usd.dataset.process.child_ahead import PLANNING_MODULE, child_ahead

    with child_ahead(PLANNING_MODULE), shown(context.obj["quiet"]) as progress:
        report = spin_usd.render(
            stage,
            out=out,
            frames=frames,
            variants=variants,
            samples=samples,
            effort=effort,
            quality=quality,
            error=error,
            measured=measured,
            seed=seed,
            labels=labels,
            labels_only=labels_only,
            renderer=renderer,
            device=device,
            radiance=radiance,
            image_format=image_format,
            workers=workers,
            cluster=cluster,
            no_cache=no_cache,
            prune=prune,
            replace=replace,
            verify=verify,
            shard=shard,
            picture_timeout=None if picture_timeout is None else parse_time_limit(picture_timeout),
            on_progress=progress,
            on_note=show_note,
        )
    show_notes(report.doubts)
    if as_json:
        show_report("render", report.as_json())
    else:
        show(_sentence(report, out, prune))
        warn_of_faults(report, out)
    exit_if_failed(report)


def _sentence(report: "RenderReport", out: str, prune: bool) -> str:
    """Say in one line what was made and what was there already."""
    removed = f", {report.pruned} removed" if prune or report.pruned else ""
    made = f"{counted(report.made, 'picture')} made, {report.reused} already there{removed}, in {report.seconds:.1f} s"
    passes = f"{counted(report.label_passes, 'label pass', 'label passes')} made, {report.labels_shared} shared"
    return f"{out}   ({made}; {passes}; {counted(report.renders, 'render')} made, {report.renders_shared} shared)"

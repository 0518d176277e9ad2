"""`spin-usd measure`: what settings of a render cost and how far they are off."""

import json
from pathlib import Path
from typing import Annotated

import typer

import spin_usd
from spin_usd.cli.arguments.options import Frames, Json, Stage
from spin_usd.cli.output.lines import BAD, Painted, show, tell
from spin_usd.cli.output.notes import show_note
from spin_usd.cli.output.progress import shown
from spin_usd.dataset.process.processors import MAX_WORKERS
from spin_usd.errors import FINDINGS


def measure(
    context: typer.Context,
    stage: Stage,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the figures; `measured` beside the stage if not given. Run again, it resumes."),
    ] = None,
    frames: Frames = None,
    count: Annotated[
        int, typer.Option(metavar="N", help="How many frames, 1 to 100, from a small target to a large one.")
    ] = 3,
    variant: Annotated[str, typer.Option(metavar="NAME", help="The variant to measure.")] = "nominal",
    seeds: Annotated[int, typer.Option(metavar="N", help="Renders of each setting, 2 to 64.")] = 3,
    max_samples: Annotated[int, typer.Option(metavar="N", help="The most light samples per pixel of a setting.")] = 64,
    reference_share: Annotated[
        float,
        typer.Option(
            metavar="X", help="The reference is good enough when its squared error is this share of the smallest one."
        ),
    ] = 0.1,
    reference_samples: Annotated[
        int, typer.Option(metavar="N", help="The most light samples per pixel of the reference.")
    ] = 4096,
    workers: Annotated[
        int,
        typer.Option(metavar="N", min=1, max=MAX_WORKERS, help="Processes that share the cores; 1 for truest times."),
    ] = 1,
    as_json: Json = False,
) -> None:
    """Measure what settings of a render cost and how far they are off, on a few pictures of a stage.

    Run again with another --count, --seeds or the like, it replaces the figures, and renders only what is missing.
    Another stage or variant takes another --out.
    """
    from spin_usd.accuracy.report import in_short
    from spin_usd.dataset.store.measurement_file import folder_of

    with shown(context.obj["quiet"]) as progress:
        found = spin_usd.measure(
            stage,
            out=out,
            frames=frames,
            count=count,
            variant=variant,
            seeds=seeds,
            max_samples=max_samples,
            reference_share=reference_share,
            reference_samples=reference_samples,
            workers=workers,
            on_progress=progress,
            on_note=show_note,
        )
    if as_json:
        show(json.dumps(found.as_json()))
    else:
        show(*in_short(found).split("\n"), f"{out or folder_of(stage)}   (measure.json, measure.md, measure.svg)")
    for failure in found.failures:
        tell((Painted("failed:", BAD), f" {failure.frame}: {failure.what}: {failure.reason}"))
    if found.failures:
        raise typer.Exit(FINDINGS)

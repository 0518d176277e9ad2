"""`spin-usd debug`: a picture's scene as a .blend, for when a picture surprises."""

from pathlib import Path
from typing import Annotated

import typer

import spin_usd
from spin_usd.cli.arguments import options
from spin_usd.cli.output.lines import show
from spin_usd.cli.output.notes import show_notes
from spin_usd.cli.output.progress import shown


def debug(
    context: typer.Context,
    *,
    stage: options.Stage,
    frame: options.Frame,
    variant: options.Variant = "nominal",
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The new file; FRAME_VARIANT.blend here if not given, FRAME as typed."),
    ] = None,
    samples: options.Samples = None,
    effort: options.EffortText = None,
    quality: options.Quality = None,
    seed: options.Seed = None,
) -> None:
    """Write the scene of a picture as a .blend: camera, lens, lights, materials and surroundings, by their USD prims.

    Blender 5.2 opens it, and F12 renders the picture before optics and detector. The text README in it says more.
    """
    with shown(context.obj["quiet"]) as progress:
        made = spin_usd.debug(
            stage,
            frame,
            variant=variant,
            out=out,
            samples=samples,
            effort=effort,
            quality=quality,
            seed=seed,
            on_progress=progress,
        )
    show_notes(made.notes)
    show(f"{made.path}   (frame {made.frame} of {made.variant})")

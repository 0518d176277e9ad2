"""`spin-usd watch`: shows what becomes of an edit of a stage, a second or two later."""

import os
import sys
from typing import Annotated

import typer

from spin_usd.cli.arguments import options
from spin_usd.cli.output.lines import show
from spin_usd.cli.output.terminal import has_colours
from spin_usd.dataset.watch.request import MAX_WIDTH, PORT, WatchedPicture, WatchRequest
from spin_usd.errors import InputError


def watch(
    *,
    stage: options.Stage,
    frame: options.Frame,
    variant: options.Variant = "nominal",
    renderer: options.RendererName = None,
    quality: Annotated[
        str, typer.Option(metavar="NAME", help="Of the picture after the preview: preview, draft, standard ...")
    ] = "draft",
    max_width: Annotated[int, typer.Option(metavar="PIXELS", min=16, help="The pictures' width at most.")] = MAX_WIDTH,
    port: Annotated[int, typer.Option(metavar="N", help="The port of the page; 0 for any that is free.")] = PORT,
    terminal: Annotated[bool, typer.Option("--terminal", help="Also show the picture in this terminal.")] = False,
) -> None:
    """Show a picture of a stage while its layers are edited: labels and a preview at once, Blender's picture after it.

    Every file that the stage is made of is watched. A layer that cannot be read is said, and the last good picture
    stays. The page, on this machine alone, also switches frame and variant. Ctrl-C ends.
    """
    from spin_usd.api.effort import setting_of
    from spin_usd.dataset.store.stage_path import existing_stage
    from spin_usd.dataset.watch.watch import watch as follow

    if terminal and not has_colours(sys.stdout):
        raise InputError("--terminal needs a terminal with colours", do="leave it out, and open the page")
    root = existing_stage(stage)
    effort = None if renderer == "raycast" else quality
    setting, _ = setting_of(
        root, renderer=renderer, measured=None, samples=None, effort=None, quality=effort, error=None
    )
    request = WatchRequest(
        stage=root,
        choice=WatchedPicture(frame=frame, variant=variant),
        renderer=setting.renderer,
        effort=setting.effort,
        max_width=max_width,
        port=port,
    )
    follow(request, tell=show, on_image=show_image if terminal else lambda png: None)


def show_image(png: bytes) -> None:
    """Show the image as wide as the terminal."""
    from spin_usd.dataset.watch.half_blocks import half_blocks

    columns = os.get_terminal_size(sys.stdout.fileno()).columns
    sys.stdout.write("".join(f"{line}\n" for line in half_blocks(png, columns)))
    sys.stdout.flush()

"""`spin-usd debug`: a picture's scene as a .blend, to inspect an unexpected result in Blender."""

import typer

import spin_usd
from spin_usd.commands.debug.options import DebugOptions
from spin_usd.options import run_with
from spin_usd.terminal.lines import print_out, show_notes
from spin_usd.terminal.progress import shown


def debug(context: typer.Context, options: DebugOptions) -> None:
    """Write the scene of a picture as a .blend: camera, lens, lights, materials, surroundings, named by USD prims.

    Open it in Blender 5.2; F12 renders the picture before optics and detector. Its text block README explains more.
    """
    with shown(context.obj["quiet"]) as progress:
        made = run_with(spin_usd.debug, options.telling(progress))
    show_notes(made.notes)
    print_out(f"{made.path}   (frame {made.frame} of {made.variant})")

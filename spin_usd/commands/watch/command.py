"""`spin-usd watch`: shows the effect of an edit of a stage, a second or two later."""

import os
import sys
from pathlib import Path

from spin_usd.commands.watch.options import WatchOptions
from spin_usd.commands.watch.request import WatchRequest
from spin_usd.errors import InputError
from spin_usd.options import EffortOptions
from spin_usd.terminal.lines import has_colours, print_out


def watch(options: WatchOptions) -> None:
    """Show a picture of a stage while you edit its layers: first labels and a preview, then Blender's picture.

    It watches every file of the stage. If a layer cannot be read, the page shows the error and keeps the last good
    picture. The page, only on this machine, can also switch frame and variant. Ctrl-C stops it.
    """
    from spin_usd.commands.watch.run import watch as follow
    from spin_usd.planning.effort_choice import setting_of
    from spin_usd.store.stage_path import existing_stage

    if options.terminal and not has_colours(sys.stdout):
        raise InputError("--terminal needs a terminal with colours", do="leave it out, and open the page")
    root = existing_stage(Path(options.stage))
    effort = EffortOptions(quality=None if options.renderer == "raycast" else options.quality)
    setting, _ = setting_of(root, effort, renderer=options.renderer)
    request = WatchRequest(stage=root, options=options, renderer=setting.renderer, effort=setting.effort)
    follow(request, tell=print_out, on_image=show_image if options.terminal else lambda png: None)


def show_image(png: bytes) -> None:
    """Show the image as wide as the terminal."""
    from spin_usd.commands.watch.run import half_blocks

    columns = os.get_terminal_size(sys.stdout.fileno()).columns
    sys.stdout.write("".join(f"{line}\n" for line in half_blocks(png, columns)))
    sys.stdout.flush()

"""`spin-usd demo`: makes an example's stage, dataset and contact sheet."""

from pathlib import Path
from typing import Annotated

import typer

from spin_usd.basics.progress import no_note
from spin_usd.commands.render.failures import exit_if_failed, warn_of_faults
from spin_usd.options import Quality, Workers
from spin_usd.terminal.lines import print_out, show_note
from spin_usd.terminal.progress import shown


def demo(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder to create.")] = Path("demo"),
    quality: Quality = None,
    workers: Workers = None,
) -> None:
    """Author the example stage, render and label it, and print the paths of the results."""
    from spin_usd.commands.demo.run import run_demo
    from spin_usd.planning.plan_calls import OPEN_PLAN
    from spin_usd.processes.child_ahead import child_ahead

    with child_ahead(OPEN_PLAN, writes=(out,)), shown(context.obj["quiet"]) as progress:
        note = no_note if context.obj["quiet"] else show_note
        made = run_demo(out, progress=progress, note=note, workers=workers, quality=quality)
    print_out(f"stage          {made.stage}   (open it in usdview, Blender or an editor)")
    print_out(f"dataset        {made.dataset}   ({made.report.pictures} pictures in {made.report.seconds:.0f} s)")
    print_out(f"contact sheet  {made.contact_sheet}   (image, depth, parts, dense pose)")
    warn_of_faults(made.report, made.dataset)
    exit_if_failed(made.report)

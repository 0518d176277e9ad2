"""`spin-usd render`: renders and labels a stage's pictures into a dataset."""

from pathlib import Path
from tempfile import gettempdir
from typing import TYPE_CHECKING

import typer

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.render.failures import exit_if_failed, warn_of_faults
from spin_usd.commands.render.options import RenderOptions
from spin_usd.files.url import is_url
from spin_usd.options import run_with
from spin_usd.terminal.lines import print_out, show_note, show_notes, show_report
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown

if TYPE_CHECKING:
    from spin_usd.commands.render.report import RenderReport


def render(context: typer.Context, options: RenderOptions, *, as_json: Json = False) -> None:
    """Render and label a stage into a dataset."""
    from spin_usd.planning.plan_calls import OPEN_PLAN
    from spin_usd.processes.child_ahead import child_ahead

    copied_to = Path(gettempdir() if is_url(options.out) else options.out)
    with child_ahead(OPEN_PLAN, writes=(copied_to,)), shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.render, options.telling(progress, show_note))
    show_notes(report.doubts)
    if as_json:
        show_report(report)
    else:
        print_out(_sentence(report, options))
        warn_of_faults(report, options.out)
    exit_if_failed(report)


def _sentence(report: "RenderReport", options: RenderOptions) -> str:
    """Return one line on the pictures made and the existing ones."""
    removed = f", {report.pruned} removed" if options.prune or report.pruned else ""
    events = f", events of {pluralise(report.events, 'variant')}" if report.events else ""
    made = f"{pluralise(report.made, 'picture')} made, {report.reused} already there{removed}{events}"
    passes = f"{pluralise(report.label_passes, 'label pass', 'label passes')} made, {report.labels_shared} shared"
    renders = f"{pluralise(report.renders, 'render')} made, {report.renders_shared} shared"
    return f"{options.out}   ({made}, in {report.seconds:.1f} s; {passes}; {renders})"

"""`spin-usd show`: writes a page that shows a dataset in a browser."""

from typing import TYPE_CHECKING

import typer

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.show.options import ShowOptions
from spin_usd.errors import FINDINGS
from spin_usd.options import run_with
from spin_usd.terminal.lines import print_err
from spin_usd.terminal.lines import print_out as print_lines
from spin_usd.terminal.progress import shown

if TYPE_CHECKING:
    from spin_usd.commands.show.run import GalleryReport

NAMED = 10  # damaged pictures that are named; the page shows all


def show(context: typer.Context, options: ShowOptions) -> None:
    """Write a page that shows a dataset in a browser: pictures, labels, values, distributions. It needs no server."""
    with shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.show, options.telling(progress))
    for name, fault in list(report.damaged.items())[:NAMED]:
        print_err(f"damaged: {name}: {fault}")
    print_lines(_sentence(report))
    if report.damaged:
        raise typer.Exit(FINDINGS)


def _sentence(report: "GalleryReport") -> str:
    """Return one line on what was written."""
    damaged = f", {len(report.damaged)} damaged" if report.damaged else ""
    return (
        f"{report.page}   ({pluralise(report.pictures, 'picture')}{damaged}: {report.made} made, {report.kept} already "
        f"there; {report.bytes / 1e6:.1f} MB; in {report.seconds:.1f} s)"
    )

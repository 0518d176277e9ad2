"""Messages at the end of a render about pictures that show little, and about failed pictures."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from spin_usd.errors import FINDINGS
from spin_usd.terminal.lines import BAD, DOUBTFUL, Painted, print_err

if TYPE_CHECKING:
    from spin_usd.commands.render.report import RenderReport


def warn_of_faults(report: "RenderReport", dataset: str | Path) -> None:
    """Print on standard error how many pictures show little, if any."""
    from spin_usd.picture.brightness import counted_faults

    if text := counted_faults(report.faults, report.made + report.reused):
        print_err((Painted("warning:", DOUBTFUL), f" {text}; spin-usd check {dataset} names them"))


def exit_if_failed(report: "RenderReport") -> None:
    """Name the pictures that failed on standard error, and end the command if there are any."""
    for each in report.failed:
        print_err((Painted("failed:", BAD), f" {each.picture}: {each.reason}"))
    if report.failed:
        raise typer.Exit(FINDINGS)

"""`spin-usd check`: prints what is wrong with a stage or a dataset."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import spin_usd
from spin_usd.commands.check.options import CheckOptions
from spin_usd.errors import FINDINGS
from spin_usd.pluralise import pluralise
from spin_usd.terminal.lines import BAD, DOUBTFUL, GOOD, Painted, print_out
from spin_usd.terminal.notes import show_note
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown
from spin_usd.terminal.report import show_report

if TYPE_CHECKING:
    from spin_usd.commands.check.report import CheckReport


def check(
    context: typer.Context,
    options: CheckOptions,
    *,
    unfolded: Annotated[
        bool, typer.Option("--all", help="List every finding; a terminal shows the first few by each rule otherwise.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Look for what is wrong with a stage or a dataset: conventions, schemas, digests, label consistency."""
    with shown(context.obj["quiet"]) as progress:
        checked = spin_usd.check(**options.arguments(on_progress=progress, on_note=show_note))
    if as_json:
        show_report(checked)
    else:
        _show(checked, Path(options.path), unfolded=unfolded)
    if checked.errors:
        raise typer.Exit(FINDINGS)


def _show(checked: "CheckReport", path: Path, *, unfolded: bool) -> None:
    """Print the report for people."""
    from spin_usd.scene.derived.view_text import summary
    from spin_usd.terminal.findings import show_findings

    print_out(*(f"repaired: {what}" for what in checked.repaired or ()))
    print_out(*(f"unrepaired: {what}" for what in checked.unrepaired or ()))
    if checked.views:
        print_out(*summary(checked.views).split("\n"))
    show_findings(checked.findings, unfolded=unfolded)
    if checked.compared is not None:
        print_out(f"compared with Cycles: {pluralise(checked.compared, 'picture')}")
    colour = BAD if checked.errors else DOUBTFUL if checked.findings else GOOD
    warnings = pluralise(len(checked.findings) - checked.errors, "warning")
    verdict = f"{pluralise(checked.errors, 'error')}, {warnings}"
    print_out((f"{checked.kind} {path}: ", Painted(verdict, colour, bold=True)))

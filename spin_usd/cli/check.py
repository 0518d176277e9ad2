"""`spin-usd check`: prints what is wrong with a stage or a dataset."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import spin_usd
from spin_usd.cli.arguments.options import Json
from spin_usd.cli.output.lines import BAD, DOUBTFUL, GOOD, Painted, show
from spin_usd.cli.output.notes import show_note
from spin_usd.cli.output.progress import shown
from spin_usd.cli.output.report import show_report
from spin_usd.counted import counted
from spin_usd.errors import FINDINGS

if TYPE_CHECKING:
    from spin_usd.dataset.check.check import CheckReport


def check(
    context: typer.Context,
    path: Annotated[Path, typer.Argument(help="A stage or a dataset.")],
    repair: Annotated[
        bool,
        typer.Option(
            "--repair",
            help="First make again what a dataset lacks or what is damaged in it, from its own copy of the stage. "
            "(render --verify does so from the stage that it is given.)",
        ),
    ] = False,
    cross: Annotated[
        bool,
        typer.Option(
            "--cross",
            help="Also cast a dataset's labels again through Cycles, which has no part in making them, and find where "
            "they differ: some 0.3 s a picture.",
        ),
    ] = False,
    cross_pictures: Annotated[
        int | None,
        typer.Option("--cross-pictures", metavar="N", help="With --cross: of so many pictures, evenly spread."),
    ] = None,
    unfolded: Annotated[
        bool, typer.Option("--all", help="List every finding; a terminal shows the first few by each rule otherwise.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Look for what is wrong with a stage or a dataset: conventions, schemas, digests, label consistency."""
    with shown(context.obj["quiet"]) as progress:
        checked = spin_usd.check(
            path,
            repair=repair,
            cross=cross,
            cross_pictures=cross_pictures,
            on_progress=progress,
            on_note=show_note,
        )
    if as_json:
        show_report("check", checked.as_json())
    else:
        _show(checked, path, unfolded=unfolded)
    if checked.errors:
        raise typer.Exit(FINDINGS)


def _show(checked: "CheckReport", path: Path, *, unfolded: bool) -> None:
    """Print the report for people."""
    from spin_usd.cli.output.findings import show_findings
    from spin_usd.dataset.repair.repair import RepairReport
    from spin_usd.scene.derived.view_text import summary

    if isinstance(checked, RepairReport):
        show(*(f"repaired: {what}" for what in checked.repaired))
        show(*(f"unrepaired: {what}" for what in checked.unrepaired))
    if checked.views:
        show(*summary(checked.views).split("\n"))
    show_findings(checked.findings, unfolded=unfolded)
    if checked.compared is not None:
        show(f"compared with Cycles: {counted(checked.compared, 'picture')}")
    colour = BAD if checked.errors else DOUBTFUL if checked.findings else GOOD
    warnings = counted(len(checked.findings) - checked.errors, "warning")
    verdict = f"{counted(checked.errors, 'error')}, {warnings}"
    show((f"{checked.kind} {path}: ", Painted(verdict, colour, bold=True)))

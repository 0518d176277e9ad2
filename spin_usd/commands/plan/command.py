"""`spin-usd plan`: a table of what a render would make, and its approximate cost."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import spin_usd
from spin_usd.basics.pluralise import duration
from spin_usd.commands.plan.options import PlanOptions
from spin_usd.options import run_with
from spin_usd.terminal.lines import print_out, show_notes, show_report
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown
from spin_usd.terminal.tables import show_table

if TYPE_CHECKING:
    from spin_usd.commands.plan.report import PlanReport
    from spin_usd.planning.variant_table import VariantRow, VariantTable

NAMED = 6  # variants at most that are named
WITHOUT_EVENTS = "these and the table do not include the events, whose cost is in the notes"
HEADINGS = ("variant", "pictures", "label passes", "renders", "exposures", "time", "disk")


def plan(context: typer.Context, options: PlanOptions, *, as_json: Json = False) -> None:
    """Estimate what a render would make and cost: pictures, label passes, renders and exposures of each variant."""
    from spin_usd.planning.plan_calls import OPEN_PLAN
    from spin_usd.processes.child_ahead import child_ahead

    with child_ahead(OPEN_PLAN), shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.plan, options.telling(progress))
    show_notes(report.notes)
    if as_json:
        show_report(report.document)
        return
    _print_cost(report.cost)
    _print_views(report)
    if options.out:
        _print_dataset(report, Path(options.out))
    total = f"about {duration(report.seconds)} with {report.workers} workers, {_size(report.cost.total.bytes)} on disk"
    print_out(f"{total}; {WITHOUT_EVENTS}" if options.events else total)
    print_out(_speed(report.cost))
    if options.explain:
        print_out(*explanation(report).split("\n"))


def _print_cost(cost: "VariantTable") -> None:
    """Print a row for each variant and a total. Counts exclude work shared with variants above; time is of one core."""
    from spin_usd.planning.variant_table import in_lines

    show_table(HEADINGS, [_cells(row) for row in (*in_lines(cost.rows), cost.total)])


def _print_views(report: "PlanReport") -> None:
    """Print what the pictures show, and the reason for the chosen effort."""
    from spin_usd.scene.derived.view_text import summary

    if report.views:
        print_out(*summary(report.views).split("\n"))
    if report.chosen:
        print_out(report.chosen.reason)


def _print_dataset(report: "PlanReport", out: Path) -> None:
    """Print what the dataset in the folder `out` already contains, and what a render would refuse."""
    from spin_usd.planning import orphans, same_stage

    print_out(f"already made: {report.cost.finished} pictures")
    if report.other_stage:
        differs = same_stage.in_words(report.other_stage)
        print_out(f"note: {out} {differs}; a render needs --replace, or another folder")
    if report.orphans:
        holds = orphans.in_words(report.orphans)
        print_out(f"note: {out} {holds}; a render needs --prune, which removes them, or another folder")


def _speed(cost: "VariantTable") -> str:
    """Return a line on the source of the times."""
    tried = f"{cost.slower:.2f} times the published ones, by a trial of this machine"
    if not cost.measured:
        return f"times are {tried}"
    return f"times of {', '.join(cost.measured)} are from earlier runs, others are {tried}"


def explanation(report: "PlanReport") -> str:
    """Return lines on skipped work: its reason, the certainty that nothing changes, and the pictures."""
    from spin_usd.planning.skipped_counts import KEPT

    lines = [
        f"{each.part}: no {each.what}: {each.why} ({each.same}; {_pictures(each.pictures, report.pictures)})"
        for each in report.skipped or ()
    ]
    return "\n".join(("skipped, because the pictures do not need it:", *lines, KEPT))


def _pictures(counts: Mapping[str, int], planned: Mapping[str, int]) -> str:
    """Return how many of the `planned` pictures of each variant the counts include."""
    if counts == planned:
        return "all pictures"
    if len(counts) > NAMED:
        return f"{sum(counts.values())} of {sum(planned.values())} pictures, of {len(counts)} variants"
    return ", ".join(f"{count} of {planned[variant]} of {variant}" for variant, count in counts.items())


def _cells(row: "VariantRow") -> tuple[str, ...]:
    name = f"{row.name} ({row.variants} variants)" if row.variants > 1 else row.name
    return name, *(str(count) for count in row.counts), duration(row.seconds), _size(row.bytes)


def _size(count: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} TB"

"""`spin-usd check`: prints the faults of a stage or a dataset, rule by rule: folded on a terminal, one line for each
finding in a pipe or a file."""

import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.check.options import CheckOptions
from spin_usd.errors import FINDINGS
from spin_usd.options import run_with
from spin_usd.scene.finding import ERROR, Finding
from spin_usd.terminal.lines import (
    BAD,
    DOUBTFUL,
    GOOD,
    NAME,
    QUIET,
    Line,
    Painted,
    is_terminal,
    print_out,
    show_note,
    show_report,
)
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown
from spin_usd.terminal.tables import show_grid

if TYPE_CHECKING:
    from spin_usd.commands.check.report import CheckReport


MAX_FOLDED = 5  # findings of a rule that a terminal shows without --all
COLOURS = {ERROR: BAD}


def check(
    context: typer.Context,
    options: CheckOptions,
    *,
    unfolded: Annotated[
        bool, typer.Option("--all", help="List every finding, where a terminal otherwise shows the first of each rule.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Check a stage or a dataset for faults: conventions, schemas, digests, label consistency."""
    from spin_usd.commands.check.calls import CHECK_PICTURE, CHECK_STAGE
    from spin_usd.processes.child_ahead import child_ahead

    with child_ahead(CHECK_STAGE, CHECK_PICTURE), shown(context.obj["quiet"]) as progress:
        checked = run_with(spin_usd.check, options.telling(progress, show_note))
    if as_json:
        show_report(checked)
    else:
        _show(checked, Path(options.path), unfolded=unfolded)
    if checked.errors:
        raise typer.Exit(FINDINGS)


def _show(checked: "CheckReport", path: Path, *, unfolded: bool) -> None:
    """Print the report for people."""
    from spin_usd.scene.derived.view_text import summary

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


@dataclass(frozen=True, kw_only=True)
class RuleFindings:
    """The findings of the rule `code` with one severity, at least one."""

    code: str
    severity: str
    findings: Sequence[Finding]
    remedy: str
    """Common remedy of all findings; "" if remedies differ or are missing."""

    @property
    def count(self) -> str:
        return pluralise(len(self.findings), self.severity)


def by_rule(findings: Iterable[Finding]) -> list[RuleFindings]:
    """Return the findings by rule: those with errors first, each kind in alphabetic order, and each rule's findings in
    the order given."""

    def key(finding: Finding) -> tuple[bool, str, str]:
        return finding.severity != ERROR, finding.severity, finding.code

    groups = [list(group) for _, group in groupby(sorted(findings, key=key), key)]
    return [RuleFindings(code=g[0].code, severity=g[0].severity, findings=g, remedy=_remedy(g)) for g in groups]


def _remedy(findings: Sequence[Finding]) -> str:
    """Return the text after the first semicolon of every message, if all are the same."""
    remedies = {finding.message.partition("; ")[2] for finding in findings}
    return remedies.pop() if len(remedies) == 1 else ""


def show_findings(findings: Iterable[Finding], *, unfolded: bool) -> None:
    """Print the findings on standard output. unfolded: all of them on a terminal too."""
    rules = by_rule(findings)
    if is_terminal(sys.stdout):
        for rule in rules:
            _show_rule(rule, unfolded=unfolded)
    else:
        print_out(*_lines(rules))


def _lines(rules: Sequence[RuleFindings]) -> Iterator[str]:
    """Yield a line for each finding, then one for each rule."""
    for rule in rules:
        for finding in rule.findings:
            yield f"{finding.severity} [{finding.code}]: {finding.where}: {finding.message}"
    for rule in rules:
        yield f"rule {rule.code}: {rule.count}"


def _show_rule(rule: RuleFindings, *, unfolded: bool) -> None:
    """Print a rule's heading, remedy and findings, on a terminal."""
    colour = COLOURS.get(rule.severity, DOUBTFUL)
    print_out((Painted(rule.code, colour, bold=True), f"  {rule.count}"))
    if rule.remedy:
        show_grid([[Painted("→", colour), rule.remedy]], indent=2)
    shown = rule.findings if unfolded else rule.findings[:MAX_FOLDED]
    end = f"; {rule.remedy}" if rule.remedy else ""
    show_grid([[Painted(each.where, NAME), each.message.removesuffix(end)] for each in shown], indent=2)
    more = len(rule.findings) - len(shown)
    rest: Line = (Painted(f"  ... and {more} more; --all lists them", QUIET),)
    print_out(*([rest] if more else []), "")

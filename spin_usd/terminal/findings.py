"""Findings of a check, rule by rule: folded on a terminal, one line for each in a pipe or a file."""

import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from spin_usd.pluralise import pluralise
from spin_usd.scene.finding import ERROR, Finding
from spin_usd.terminal.lines import BAD, DOUBTFUL, NAME, QUIET, Line, Painted, is_terminal, print_out
from spin_usd.terminal.tables import show_grid

MAX_FOLDED = 5  # findings of a rule that a terminal shows, unless asked for all
COLOURS = {ERROR: BAD}


@dataclass(frozen=True, kw_only=True)
class RuleFindings:
    """The findings by the rule `code` that are of one severity, at least one. remedy: what to do about all of them; ""
    where that differs or is not said."""

    code: str
    severity: str
    findings: Sequence[Finding]
    remedy: str

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
    """Return what follows the first semicolon of every message, where that is the same."""
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
            yield f"{finding.severity}: {finding.where}: {finding.message} [{finding.code}]"
    for rule in rules:
        yield f"rule {rule.code}: {rule.count}"


def _show_rule(rule: RuleFindings, *, unfolded: bool) -> None:
    """Print a rule's heading, what to do, and its findings, on a terminal."""
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

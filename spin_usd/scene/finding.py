"""Findings of a check on a stage or a dataset."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from spin_usd.basics.json_fields import one_of

ERROR, WARNING = "error", "warning"
MAX_SENTENCES = 3  # sentences by one rule


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A fault of a stage or a dataset, and its place."""

    code: Annotated[
        str, Meta(pattern="^[A-Za-z0-9:.-]+$", description="The rule; of USD's own validators their identifier.")
    ]
    where: Annotated[str, Meta(description="A prim's path or a file.")]
    message: Annotated[str, Meta(description="The fault, and after a semicolon the remedy.")]
    severity: Annotated[str, one_of(ERROR, WARNING), Meta(description="A warning fails nothing.")] = ERROR


def in_sentences(findings: Iterable[Finding]) -> list[str]:
    """One sentence for each of the findings; of many by one rule the first few, and how many more there are."""
    by_code: dict[str, list[str]] = {}
    for finding in findings:
        by_code.setdefault(finding.code, []).append(f"{finding.where}: {finding.message}")
    return [text for lines in by_code.values() for text in (*lines[:MAX_SENTENCES], *_rest(lines))]


def _rest(lines: list[str]) -> list[str]:
    more = len(lines) - MAX_SENTENCES
    return [f"{more} more prims are rendered likewise; spin-usd check names them"] if more > 0 else []

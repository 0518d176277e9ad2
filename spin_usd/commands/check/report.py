"""The report that `check` returns."""

from typing import Annotated, Literal

from msgspec import Meta

from spin_usd.basics.json_fields import Count, JsonStruct
from spin_usd.scene.derived.views import Views
from spin_usd.scene.finding import ERROR, Finding


class CheckReport(JsonStruct, frozen=True, kw_only=True, omit_defaults=True, tag_field="schema", tag="check-report-1"):
    """Output of spin-usd check --json. The exit code is 1 if a finding is an error, 0 otherwise."""

    kind: Literal["stage", "dataset", "set"]
    findings: list[Finding]
    views: Annotated[Views | None, Meta(description="Of a stage's own pictures, where they can be read.")] = None
    layout: Annotated[str | None, Meta(description="Layout of a data set of others.")] = None
    reasons: Annotated[list[str] | None, Meta(description="Why it is read in that layout, and what it lacks.")] = None
    compared: Annotated[
        Count | None,
        Meta(description="Pictures whose labels were compared with Cycles' labels; only with --cross."),
    ] = None
    repaired: Annotated[list[str] | None, Meta(description="Files made again; only with --repair.")] = None
    unrepaired: Annotated[list[str] | None, Meta(description="Files that failed, and why; only with --repair.")] = None

    @property
    def errors(self) -> int:
        """The number of findings that are errors: the others are warnings."""
        return sum(finding.severity == ERROR for finding in self.findings)

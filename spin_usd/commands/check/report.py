"""The report that `check` returns."""

from dataclasses import asdict, dataclass
from typing import Any

from spin_usd.scene.derived.views import Views
from spin_usd.scene.finding import ERROR, Finding


@dataclass(frozen=True, kw_only=True)
class CheckReport:
    """The findings of a check.

    kind: "stage" or "dataset" · findings: what is wrong with it · views: what a stage's own pictures show, where they
    can be read · compared: how many pictures' labels were compared with those that Cycles casts, None where that was
    not asked for.
    """

    kind: str
    findings: list[Finding]
    views: Views | None = None
    compared: int | None = None

    @property
    def errors(self) -> int:
        """The number of findings that are errors: the others are warnings."""
        return sum(finding.severity == ERROR for finding in self.findings)

    def as_json(self) -> dict[str, Any]:
        more: dict[str, Any] = {"views": self.views.as_json()} if self.views else {}
        more |= {} if self.compared is None else {"compared": self.compared}
        return {"kind": self.kind, "findings": [asdict(finding) for finding in self.findings], **more}

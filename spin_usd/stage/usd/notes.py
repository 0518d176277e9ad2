"""Warnings about what is rendered differently from what the stage authors: a picture with a warning is better than
none."""

from dataclasses import dataclass, field

from spin_usd.scene.finding import WARNING, Finding


@dataclass(eq=False)
class Notes:
    """A collection of findings: each rule is reported once for each prim or property."""

    _found: dict[tuple[str, str], Finding] = field(default_factory=dict)

    def add(self, code: str, where: object, message: str) -> None:
        """Add a warning. `code` names the rule, `where` is a prim or a property."""
        finding = Finding(code=code, where=str(where), message=message, severity=WARNING)
        self._found.setdefault((code, str(where)), finding)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All findings, in the order in which they were added."""
        return tuple(self._found.values())

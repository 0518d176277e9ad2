"""What is rendered otherwise than a stage says, and told: a picture of it is better than none."""

from dataclasses import dataclass, field

from spin_usd.scene.finding import WARNING, Finding


@dataclass(eq=False)
class Notes:
    """Collects findings, each rule's once for each place."""

    _found: dict[tuple[str, str], Finding] = field(default_factory=dict)

    def add(self, code: str, where: object, message: str) -> None:
        """`code` names the rule, `where` is a prim or a property."""
        finding = Finding(code=code, where=str(where), message=message, severity=WARNING)
        self._found.setdefault((code, str(where)), finding)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """In the order in which they were met."""
        return tuple(self._found.values())

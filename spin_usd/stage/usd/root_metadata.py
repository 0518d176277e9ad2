"""Metadata of a stage's root layer, and the warnings that are gathered while a stage is read."""

from dataclasses import dataclass, field

from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.scene.finding import WARNING, Finding

METRES_PER_UNIT = "metersPerUnit"
UNITS = 1e-12, 1e17
"""The shortest and the longest unit that there is a use for, metres: a picometre, some parsecs."""


def root_number(stage: Usd.Stage, name: str) -> float:
    """Return the metadatum `name` of the root layer, or USD's fallback. Raises StageError unless it is a number.

    It may be of any numeric type: USD declares it double and raises on a float, which crate files by some exporters
    hold.
    """
    value = stage.GetMetadata(name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        where = stage.GetRootLayer().realPath
        raise StageError(f"{name} is {value!r}", where=where, do="author a number")
    return float(value)


def metres_per_unit(stage: Usd.Stage) -> float:
    """Return the length of a stage unit. Raises StageError for units or an up axis that are not valid."""
    where = stage.GetRootLayer().realPath
    metres = root_number(stage, METRES_PER_UNIT)
    if not UNITS[0] <= metres <= UNITS[1]:
        do = f"make it positive, {UNITS[0]:g} to {UNITS[1]:g}"
        raise StageError(f"metersPerUnit is {metres:g}", where=where, do=do)
    up = str(UsdGeom.GetStageUpAxis(stage))
    if up not in ("Y", "Z"):
        raise StageError(f"upAxis is '{up}'", where=where, do="set it to Y or Z")
    return metres


@dataclass(eq=False)
class Notes:
    """Warnings about features that are rendered differently from the stage's opinions: better than no picture.

    Each rule is reported once for each prim or property.
    """

    _found: dict[tuple[str, str], Finding] = field(default_factory=dict)

    def add(self, code: str, where: object, message: str) -> None:
        """Add a warning. `code` names the rule, `where` is a prim or a property."""
        finding = Finding(code=code, where=str(where), message=message, severity=WARNING)
        self._found.setdefault((code, str(where)), finding)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All findings, in the order in which they were added."""
        return tuple(self._found.values())

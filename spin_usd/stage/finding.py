"""What a check found on a stage."""

from dataclasses import dataclass

ERROR, WARNING = "error", "warning"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """code names the rule · where is a prim path or a layer's file · severity is "error" or "warning"."""

    code: str
    where: str
    message: str
    severity: str = ERROR

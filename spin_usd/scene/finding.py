"""What a check finds on a stage or a dataset."""

from dataclasses import dataclass

ERROR, WARNING = "error", "warning"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """code names the rule · where is a prim path or a file · severity is "error", or "warning" for what fails
    nothing."""

    code: str
    where: str
    message: str
    severity: str = ERROR

"""What a check finds."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Something wrong: `code` for programs, `where` a file or prim, `message` for people; a "warning" fails nothing."""

    code: str
    where: str
    message: str
    severity: str = "error"

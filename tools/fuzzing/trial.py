"""A trial: one hostile input with the commands that are given it, and what came of it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum

from fuzzing.running.ended import Command
from fuzzing.sandbox import Sandbox


class Verdict(StrEnum):
    """What a trial came to, the worst last."""

    FINE = "fine"
    FINDINGS = "findings"
    REFUSED = "refused"
    TRACEBACK = "tracebacks"
    CRASH = "crashes"
    HANG = "hangs"
    LOSS = "losses"
    ESCAPE = "escapes"

    @property
    def keeps_the_promise(self) -> bool:
        """Whether this may happen."""
        return self in (Verdict.FINE, Verdict.FINDINGS, Verdict.REFUSED)


ORDER = tuple(Verdict)


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One input.

    kind: its class, or the format that it is a mutant of · name: within the class · prepare: puts it into a sandbox and
    returns the commands · own: files and folders below `work` that the commands may change · alone: each command needs
    a process of its own · patience_s: how long each may take; more than usual where the documents promise more.
    """

    kind: str
    name: str
    prepare: Callable[[Sandbox], Iterable[Command]]
    own: tuple[str, ...] = ("out", "ds", "st")
    alone: bool = False
    patience_s: float = 20.0

    @property
    def title(self) -> str:
        """How --only names it."""
        return f"{self.kind}/{self.name}"


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """verdict: the worst of the commands' · commands: what was called · why: what was seen · seconds: the slowest's."""

    verdict: Verdict
    commands: tuple[Command, ...]
    why: str
    seconds: float

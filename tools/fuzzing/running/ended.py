"""How a command ended, and what is asked of one."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Stream = Literal["kept", "full", "closed", "pipe"]
PATIENCE_S = 20.0


def patience(seconds: float = PATIENCE_S) -> float:
    """So many seconds of a processor of one's own: more where more programs run than there are processors."""
    return seconds * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


@dataclass(frozen=True, kw_only=True)
class Command:
    """One call of spin-usd, in the sandbox's `work` folder.

    arguments: those after `spin-usd` · allowed: exit codes that keep the promise · stdout, stderr: where they go;
    `full` is a full disk, `closed` none at all, `pipe` one that nobody reads · limits: of `resource`, by name, soft and
    hard · environment: variables that are set, or with None taken away · signals: each sent so many seconds after the
    start · in_folder: the folder that it is called in, below `work`.
    """

    arguments: tuple[str, ...]
    allowed: frozenset[int] = frozenset({0, 1, 2})
    stdout: Stream = "kept"
    stderr: Stream = "kept"
    limits: Mapping[str, int] = field(default_factory=dict)
    environment: Mapping[str, str | None] = field(default_factory=dict)
    signals: tuple[tuple[float, int], ...] = ()
    in_folder: str = "."

    @property
    def plain(self) -> bool:
        """Whether it needs no process of its own: nothing but its arguments is unusual."""
        usual = self.stdout == self.stderr == "kept" and self.in_folder == "."
        return usual and not (self.limits or self.environment or self.signals)


@dataclass(frozen=True, kw_only=True)
class Ended:
    """How a command ended. code: its exit code, negative for a signal, None where it was still running and was ended
    after `seconds`."""

    code: int | None
    out: str
    err: str
    seconds: float


def call(*arguments: object, **unusual: object) -> Command:
    """A command of these arguments."""
    return Command(arguments=tuple(map(str, arguments)), **unusual)  # type: ignore[arg-type]

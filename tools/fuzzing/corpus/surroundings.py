"""Classes: limits of the machine, and signals at every moment."""

import signal
from collections.abc import Iterator
from functools import partial
from typing import Any

from fuzzing.corpus.calls import author, check, dataset, inputs, render, trial
from fuzzing.running.ended import Command, call
from fuzzing.sandbox import Sandbox
from fuzzing.trial import Trial

MEMORY = (100, 500, 1000, 2000, 4000, 8000)  # MB of address space
FILES = (3, 6, 9, 12, 16, 24, 64)
FILE_SIZES = (0, 1, 1000, 10_000, 100_000)
SIGNALLED = 128  # and the signal's number: the exit code of what a signal ended
MOMENTS_S = (0.05, 0.3, 0.8, 1.5, 3.0)
ENDED_BY = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE)
Unusual = dict[str, Any]  # fields of a Command
UNUSUAL: dict[str, Unusual] = {
    "no HOME": {"environment": {"HOME": None}},
    "HOME is missing": {"environment": {"HOME": "/nowhere"}},
    "HOME is a file": {"environment": {"HOME": "/etc/passwd"}},
    "TMPDIR is missing": {"environment": {"TMPDIR": "/nowhere"}},
    "C locale": {"environment": {"LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0"}},
    "unknown locale": {"environment": {"LC_ALL": "xx_YY.UTF-9"}},
    "no PATH": {"environment": {"PATH": None}},
    "empty PATH": {"environment": {"PATH": ""}},
    "PYTHONPATH of the user": {"environment": {"PYTHONPATH": "."}},
    "PXR plug-ins of the user": {"environment": {"PXR_PLUGINPATH_NAME": "."}},
    "narrow terminal": {"environment": {"COLUMNS": "1"}},
    "terminal of no columns": {"environment": {"COLUMNS": "0"}},
    "terminal of words": {"environment": {"COLUMNS": "wide", "TERM": "nonsense"}},
    "standard output full": {"stdout": "full"},
    "standard output closed": {"stdout": "closed"},
    "standard output to nobody": {"stdout": "pipe"},
    "standard error full": {"stderr": "full"},
    "standard error closed": {"stderr": "closed"},
    "standard error to nobody": {"stderr": "pipe"},
    "both closed": {"stdout": "closed", "stderr": "closed"},
    "both full": {"stdout": "full", "stderr": "full"},
}


def limits() -> Iterator[Trial]:
    """Little memory, few files, small files, no HOME, streams that are full or closed, folders that cannot be
    written."""
    settings: dict[str, Unusual] = {}
    settings |= {f"{size} MB of memory": {"limits": {"RLIMIT_AS": size << 20}} for size in MEMORY}
    settings |= {f"{count} open files": {"limits": {"RLIMIT_NOFILE": count}} for count in FILES}
    settings |= {f"files of {size} bytes": {"limits": {"RLIMIT_FSIZE": size}} for size in FILE_SIZES}
    settings |= {name: dict(unusual) for name, unusual in UNUSUAL.items()}
    for name, unusual in settings.items():
        if name in ("no PATH", "standard output to nobody", "standard error to nobody") or name.startswith(
            ("files of", "3 open")
        ):
            unusual["allowed"] = frozenset({0, 1, 2, -signal.SIGPIPE, -signal.SIGXFSZ, 127})
        for command in ("check", "author", "render"):
            yield trial("limits", f"{command} with {name}", partial(_unusual, command, unusual), alone=True)
    for command in ("check", "author", "render"):
        yield trial(
            "limits", f"{command} with a folder that cannot be written", partial(_read_only, command), alone=True
        )


def signals() -> Iterator[Trial]:
    """A signal at each moment of `author` and `render`, and two at once."""
    for number in ENDED_BY:
        for after_s in MOMENTS_S:
            for command in ("author", "render"):
                name = f"{number.name} after {after_s} s of {command}"
                sent = ((after_s, int(number)),)
                yield trial("signals", name, partial(_signalled, command, sent), alone=True, own=("out",))
    for after_s in MOMENTS_S:
        twice = ((after_s, int(signal.SIGINT)), (after_s + 0.2, int(signal.SIGINT)))
        yield trial("signals", f"SIGINT twice after {after_s} s", partial(_signalled, "render", twice), alone=True)


def _command(name: str, **unusual: Any) -> Command:
    if name == "check":
        return check("ds", **unusual)
    return author(**unusual) if name == "author" else render(**unusual)


def _unusual(name: str, unusual: Unusual, sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    dataset(sandbox)
    return [_command(name, **unusual)]


def _read_only(name: str, sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    dataset(sandbox)
    if name == "check":
        return [check("/proc/self")]
    return [author("--out", "/proc/out") if name == "author" else render("st", "/proc/out")]


def _signalled(name: str, sent: tuple[tuple[float, int], ...], sandbox: Sandbox) -> list[Command]:
    """The command, which may end early, and once more: it takes up where it stopped, or begins anew."""
    inputs(sandbox)
    dataset(sandbox)
    codes = frozenset({0, 1, SIGNALLED + sent[0][1], -sent[0][1]})
    first = _command(name, signals=sent, allowed=codes)
    return [first, render("st", "out") if name == "render" else call("check", "ds")]

"""The error tree: every failure that a user can cause or fix is a SpinError.

    SpinError                     exit code 2
        InputError                ValueError: a file or an argument
            NotFramedError        no sampled pose has the target in the picture as required
        GeometryError             ValueError: a rotation, a camera, a mesh
        FrameError                TypeError: transforms whose frames do not touch
        StageError                ValueError: a USD stage
            UnknownPictureError   also an InputError: no such variant or frame
        UnsupportedError          NotImplementedError: not rendered by this version, or not on this machine
        MissingPackageError       ImportError: a package that is not installed
        OutputError               OSError: a result that could not be written
        RenderError               RuntimeError, exit code 1: a renderer or its process
            ChildDiedError        (in `processes.deaths`) a process that ended before it answered

A message is one sentence: what was found, where, and what to do next. Each class is also a built-in kind, so that
callers who know nothing of spin_usd can still catch it.
"""

DONE = 0
FINDINGS = 1
BAD_INPUT = 2
INTERNAL = 3


class SpinError(Exception):
    """Base of all expected failures.

    Attributes:
        found: What is wrong.
        where: The file, prim or setting that has it; None for an argument.
        do: What to do next; None where that is plain.
        exit_code: The command line's for it.
    """

    exit_code = BAD_INPUT

    def __init__(self, found: str, *, where: object = None, do: str | None = None) -> None:
        self.found, self.where, self.do = found, where, do
        at, found, do = _shortened(printable("" if where is None else str(where)), found, do or "")
        super().__init__(f"{at}{': ' if where is not None else ''}{found}{'; ' if do else ''}{do}")


class InputError(SpinError, ValueError):
    """A file or an argument given by the user cannot be accepted."""


class NotFramedError(InputError):
    """No sampled pose has the target in the picture as required."""


class GeometryError(SpinError, ValueError):
    """Numbers that do not form what their name says: a rotation, a camera, a mesh."""


class FrameError(SpinError, TypeError):
    """Two transforms whose frames do not touch were combined."""


class StageError(SpinError, ValueError):
    """A USD stage does not compose, or lacks what a picture needs."""


class UnknownPictureError(StageError, InputError):
    """A stage has no such variant, or no such frame."""


class UnsupportedError(SpinError, NotImplementedError):
    """The stage asks for something that this version does not render; nothing is dropped silently."""


class MissingPackageError(SpinError, ImportError):
    """A package of one of the extras is not installed."""


class OutputError(SpinError, OSError):
    """A result could not be written, or came back different from what was written."""


class RenderError(SpinError, RuntimeError):
    """A renderer failed on a frame."""

    exit_code = FINDINGS


def printable(text: str) -> str:
    """Return the text as one line that shows what it holds, and steers no terminal: all but printable characters stand
    as escapes, such as \\n, \\x1b, \\u202e, which turns the direction, or \\udcff for a byte that is not UTF-8."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def _shortened(*texts: str, limit: int = 600) -> list[str]:
    """Return the texts, each on one line, of at most `limit` printable characters in all: stage strings can hold
    anything. The longest lose their middles, so that what to do is never lost to what is quoted."""
    lines = [printable(" ".join(text.split())) for text in texts]
    each = next(each for each in range(limit, 0, -1) if sum(min(len(line), each) for line in lines) <= limit)
    return [
        line if len(line) <= each else f"{line[: each // 2]}…{line[len(line) - (each - 1) // 2 :]}" for line in lines
    ]

"""Errors of USD while it reads files, turned into errors of the input: many values are unpacked long after a layer was
opened."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from pxr import Tf

from spin_usd.errors import StageError

NOT_UTF_8 = "it holds text that is not UTF-8"
SYNTAX_ERROR = re.compile(r".*?:(\d+):(\d+): (.*) at '(.*)' in <.*>", re.DOTALL)
GRAMMAR = "parse error matching "  # followed by a rule of USD's grammar, as C++ spells its type
MAX_QUOTE = 60


def parser_fault(error: BaseException, where: object = None) -> StageError | None:
    """Return the fault of the input that USD reports by `error`; None where `error` is not USD's. `where`: the file
    that was read."""
    if not isinstance(error, Tf.ErrorException | UnicodeDecodeError):
        return None
    return StageError(f"USD cannot read it: {reason(error)}", where=where, do="fix the layer, or write it again")


@contextmanager
def parser_faults(where: object) -> Iterator[None]:
    """Raise StageError, which names `where`, for USD's errors within this context."""
    try:
        yield
    except (Tf.ErrorException, UnicodeDecodeError) as error:
        raise parser_fault(error, where) or error from None


def reason(error: Tf.ErrorException | UnicodeDecodeError) -> str:
    """Return USD's message without the place in its source code: with the place in the layer where it names one, else
    its first message."""
    try:
        messages = [str(getattr(each, "commentary", each)).strip() for each in error.args] or [str(error)]
    except UnicodeDecodeError:
        return NOT_UTF_8
    if isinstance(error, UnicodeDecodeError):
        return NOT_UTF_8
    placed = [found for found in map(SYNTAX_ERROR.fullmatch, messages) if found]
    if not placed:
        return messages[0]
    line, column, problem, text = placed[0].groups()
    text = text if len(text) <= MAX_QUOTE else f"{text[: MAX_QUOTE - 1]}…"
    problem = "cannot be understood" if problem.startswith(GRAMMAR) else problem
    return f"line {line}, column {column}: {problem}, at {repr(text) if text else 'the end of the line'}"

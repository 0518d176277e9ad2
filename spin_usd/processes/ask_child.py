"""One call to a child process of its own, which reads files of others and may die of them."""

import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from spin_usd.errors import RenderError, SpinError, StageError
from spin_usd.processes.call import Answer, Call, Request
from spin_usd.processes.child import HAND_ON, Child, in_process
from spin_usd.processes.child_ahead import next_child
from spin_usd.processes.child_limits import PATIENCE_S
from spin_usd.processes.deaths import ChildDiedError, DeathCause

FOR_LOADING = ("PYTHONPATH", "LD_LIBRARY_PATH")  # which children do not get
LOADING = re.compile(r"ModuleNotFoundError|ImportError|cannot open shared object|No module named")
CONFINE = Call("spin_usd.processes.confine:confine", str, bool)


def ask_child(
    call: Call[Request, Answer],
    request: Request,
    *,
    reads: object,
    memory: int | None = None,
    progress: Callable[..., None] | None = None,
    within_s: float = PATIENCE_S,
    below: Path | None = None,
    writes: Sequence[Path] | None = (),
) -> Answer:
    """Return the answer to a call from a child of its own: the one started ahead, unless `memory` is given, as for
    Child, like `writes`. `reads`: the file that it reads, for messages; `within_s` limits the wait for each message
    from it; `below`: the only folder from which it may read a user's files. Its temporary files are removed in the end.

    Raises the errors of the child, and the error of `unreadable` if it dies.
    """
    with next_child(call, writes=writes or ()) if memory is None else Child(memory=memory, writes=writes) as child:
        try:
            if below is not None and not in_process():
                child.call(CONFINE, str(below))
            return child.call(call, request, progress=progress, within_s=within_s)
        except ChildDiedError as died:
            raise unreadable(died, reads) from died


def unreadable(died: ChildDiedError, where: object) -> SpinError:
    """Return the error on a file whose reading killed a child; if the cause is outside, or the child waited for
    something, an error that does not blame the file."""
    if died.cause is DeathCause.KILLED:
        do = "look for the cause, such as a lack of memory, and run it again"
        return RenderError(f"was not read: {died.found}", where=where, do=do)
    if lacking := [each for each in FOR_LOADING if each in os.environ and LOADING.search(died.found)]:
        do = f"install what is missing, or give children {' and '.join(lacking)} too: {HAND_ON}={','.join(lacking)}"
        return RenderError(f"was not read: {died.found}", where=where, do=do)
    if died.cause is DeathCause.HUNG:
        do = "look at the disk, network or driver that it waits for, and run it again"
        return RenderError(f"was not read: {died.found}", where=where, do=do)
    return StageError(f"cannot be read: {died.found}", where=where, do="simplify it, or look for multiplied content")

"""One question to a child process of its own, which reads what others wrote and may die of it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from spin_usd.errors import RenderError, SpinError, StageError
from spin_usd.processes.child import Child, in_process
from spin_usd.processes.child_ahead import next_child
from spin_usd.processes.child_limits import PATIENCE_S
from spin_usd.processes.deaths import ChildDiedError, DeathCause


def ask_child(
    call: str,
    *,
    reads: object,
    memory: int | None = None,
    progress: Callable[..., None] | None = None,
    within_s: float = PATIENCE_S,
    below: Path | None = None,
    **arguments: Any,
) -> Any:
    """Return what `call` returns in a child of its own, the one started ahead unless `memory`, that of Child, is given.
    `reads`: the file that it does, for messages; `within_s` bounds the wait for each word from it; `below`: a folder
    below which alone it may read a user's files. Its temporary files are gone in the end.

    Raises what the child raises, and as `unreadable` says where it dies.
    """
    with next_child() if memory is None else Child(memory=memory) as child:
        try:
            if below is not None and not in_process():
                child.call("confine", root=str(below))
            return child.call(call, progress=progress, within_s=within_s, **arguments)
        except ChildDiedError as died:
            raise unreadable(died, reads) from died


def unreadable(died: ChildDiedError, where: object) -> SpinError:
    """Return the error on a file whose reading killed a child; where something else killed that, or it
    waited for something, one that does not blame the file."""
    if died.cause is DeathCause.KILLED:
        do = "look for what ends processes, such as a lack of memory, and run it again"
        return RenderError(f"was not read: {died.found}", where=where, do=do)
    if died.cause is DeathCause.HUNG:
        do = "look at the disk, network or driver that it waits for, and run it again"
        return RenderError(f"was not read: {died.found}", where=where, do=do)
    return StageError(f"cannot be read: {died.found}", where=where, do="simplify it, or look for what multiplies in it")

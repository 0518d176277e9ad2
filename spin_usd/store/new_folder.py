"""A folder that appears whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from spin_usd.errors import InputError, OutputError
from spin_usd.store.atomic import force_folder
from spin_usd.store.hidden_folder import hidden_folder, remove_leftovers


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """Make a folder hidden beside `out` to write in; it becomes `out` if the block succeeds, else it is removed.

    Remains of killed processes for the same `out` are removed first. Raises InputError if `out` exists and is not an
    empty folder, or is a link, which a folder cannot replace; OutputError if it cannot be made.
    """
    if out.is_symlink():
        raise InputError("is a link", where=out, do="give the folder that it leads to, or remove it")
    if out.exists() and not out.is_dir():
        raise InputError("is a file, not a folder", where=out, do="give a new folder")
    if out.exists() and any(out.iterdir()):
        raise InputError("exists already and is not empty", where=out, do="give a new folder, or remove it")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot be made ({error.strerror})", where=out) from None
    with hidden_folder(out.parent, out.name) as hidden:
        work = hidden.folder / out.name
        try:
            work.mkdir()
            yield work
            force_folder(work)
            os.replace(work, out)
        except OutputError as error:
            where = str(error.where or out).replace(str(work), str(out))
            raise OutputError(error.found, where=where, do=error.do) from None
        except OSError as error:
            raise OutputError(f"cannot be written ({error.strerror or error})", where=out) from None


@contextmanager
def nothing_left_of(out: Path) -> Iterator[None]:
    """Remove the hidden remains beside `out` if a process that makes it in the block is killed."""
    try:
        yield
    except BaseException:
        with suppress(OSError):
            remove_leftovers(out.parent, out.name)
        raise

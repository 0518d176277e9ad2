"""A folder that appears whole or not at all."""

import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil

from spin_usd.errors import InputError, OutputError


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """A temporary folder beside `out` to write in; it becomes `out` when the block ends well, else it is removed.

    What killed processes left for the same `out` is removed first. Raises InputError when `out` exists and is not an
    empty folder, OutputError when it cannot be made.
    """
    if out.exists() and not (out.is_dir() and not any(out.iterdir())):
        raise InputError("exists already and is not empty", where=out, do="give a new folder, or remove it")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        _sweep(out)
        work = Path(tempfile.mkdtemp(prefix=f".{out.name}.{os.getpid()}.", dir=out.parent))
    except OSError as error:
        raise OutputError(f"cannot be made ({error.strerror})", where=out) from None
    try:
        yield work
        work.chmod(0o777 & ~_umask())  # mkdtemp makes it for its owner alone
        os.replace(work, out)
    except OutputError as error:
        where = str(error.where or out).replace(str(work), str(out))
        raise OutputError(error.found, where=where, do=error.do) from None
    except OSError as error:
        raise OutputError(f"could not be written ({error.strerror or error})", where=out) from None
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _sweep(out: Path) -> None:
    """Remove the temporary folders for `out` whose processes are gone; their ids are in the folders' names."""
    for folder in out.parent.iterdir():
        owner = re.fullmatch(rf"\.{re.escape(out.name)}\.(\d+)\.[^.]+", folder.name)
        if owner and not psutil.pid_exists(int(owner[1])):
            shutil.rmtree(folder, ignore_errors=True)


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current

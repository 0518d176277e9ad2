"""A folder to write in that is ours by a random token, in its name and in the lock in it."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from spin_usd.errors import InputError, OutputError
from spin_usd.files.changes import remove_file, remove_tree
from spin_usd.files.folder import Folder
from spin_usd.files.node import NodeType
from spin_usd.store.lock import create_lock, new_token, take_lock

LOCK = ".lock"


class HiddenFolder(NamedTuple):
    """The folder, and a file beside another that bears the same token and may be written too, where one is wanted."""

    folder: Path
    beside: Path


@contextmanager
def hidden_folder(parent: Path, name: str, *, beside: str = "none") -> Iterator[HiddenFolder]:
    """Make the folder `.NAME.TOKEN` in `parent`, and a file of a name derived from `beside`, for the duration of the
    block.

    Remains of killed processes are removed first: folders of that name whose lock has the token of their name, and is
    free. Raises OutputError if it cannot be made.
    """
    token = new_token()
    hidden = _hidden(parent, name, beside, token)
    try:
        remove_leftovers(parent, name, beside=beside)
        hidden.folder.mkdir()
        try:
            create_lock(hidden.folder / LOCK, token)
        except OSError:
            hidden.folder.rmdir()
            raise
    except OSError as e:
        raise OutputError(f"cannot be written ({e.strerror})", where=parent, do="choose another folder") from e
    lock = None
    with suppress(OSError):  # a file system without locks: remains are not removed
        lock = take_lock(hidden.folder / LOCK)
    try:
        yield hidden
    finally:
        _remove(hidden)
        if lock:
            os.close(lock.descriptor)


def remove_leftovers(parent: Path, name: str, *, beside: str = "none") -> None:
    """Remove hidden folders of that name that killed processes left. Raises OSError if `parent` cannot be listed."""
    for entry in os.listdir(parent):
        if found := re.fullmatch(rf"\.{re.escape(name)}\.([0-9a-f]{{32}})", entry):
            _remove_left(_hidden(parent, name, beside, found[1]), found[1])


def _remove_left(left: HiddenFolder, token: str) -> None:
    if Folder(left.folder.parent).type_of(left.folder.name) is not NodeType.FOLDER:
        return
    with suppress(OSError):  # another user's
        if lock := take_lock(left.folder / LOCK):
            if lock.token == token:
                _remove(left)
            os.close(lock.descriptor)


def _hidden(parent: Path, name: str, beside: str, token: str) -> HiddenFolder:
    file = Path(beside)
    return HiddenFolder(parent / f".{name}.{token}", parent / f".{file.stem}.{token}{file.suffix}")


def _remove(hidden: HiddenFolder) -> None:
    parent = Folder(hidden.folder.parent)
    with suppress(InputError, OutputError):  # it is not ours, then
        remove_file(parent, hidden.beside.name)
    remove_tree(parent, hidden.folder.name)

"""A few small stages and datasets that many tests read: each is made once a run, by whichever process asks first.

Nobody changes them: a test that does copies them first.
"""

import fcntl
from collections.abc import Callable
from pathlib import Path

import pytest


class Library:
    """The things made so far, each a folder of its own in `root`, which all processes of the run share."""

    def __init__(self, root: Path) -> None:
        self._root = root

    def folder(self, name: str, make: Callable[[Path], object]) -> Path:
        """Return the folder of that name; where nobody has made it yet, `make` fills it now, and others wait."""
        folder, done = self._root / name, self._root / f"{name}.made"
        with (self._root / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not done.exists():
                folder.mkdir()
                make(folder)
                done.touch()
        return folder


def library_of(tmp_path_factory: pytest.TempPathFactory, *, shared: bool) -> Library:
    """Return the library of the run; `shared`: whether this process is one of several of pytest-xdist, whose folders
    lie beside one another."""
    own = tmp_path_factory.getbasetemp()
    root = (own.parent if shared else own) / "library"
    root.mkdir(exist_ok=True)
    return Library(root)

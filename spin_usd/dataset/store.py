"""A dataset's folder: names, atomic writes, the lock, and what an interrupted run left behind.

dataset.json                         schema dataset-1
stage/                               the layers that made it
records/<variant>/<frame>.json       schema record-1, the index: written last, so a record means a finished picture
<kind>/<variant>/<frame>.<suffix>    image, depth, segmentation, dense_pose, radiance
cache/                               renders and labels by content (dataset.cache)
"""

import fcntl
import hashlib
import json
import os
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spin_usd.dataset.schema import read_json
from spin_usd.errors import InputError, OutputError, SpinError

CACHE = "cache"
WORK = ".work"
LOCK = ".lock"
TEMPORARY = ".tmp-"
LOCK_PATIENCE_S = 5.0  # a killed run's last worker needs a moment to die


@dataclass(frozen=True, kw_only=True)
class Store:
    """The dataset in the folder `root`."""

    root: Path

    @property
    def description(self) -> Path:
        return self.root / "dataset.json"

    @property
    def stage(self) -> Path:
        return self.root / "stage"

    @property
    def cache(self) -> Path:
        """Results by content, which no reader of the dataset needs."""
        return self.root / CACHE

    @property
    def work(self) -> Path:
        """Temporary files of a run; gone when none is running."""
        return self.root / WORK

    def record(self, variant: str, frame: str) -> Path:
        return self.root / "records" / variant / f"{frame}.json"

    def file(self, kind: str, variant: str, frame: str, suffix: str) -> Path:
        return self.root / kind / variant / f"{frame}{suffix}"

    def relative(self, path: Path) -> str:
        return path.relative_to(self.root).as_posix()

    def records(self) -> Iterator[Path]:
        """All records, ordered by variant and frame."""
        return iter(sorted((self.root / "records").glob("*/*.json")))

    def prepare(self) -> None:
        """Make the folder. InputError when it holds anything but a dataset, OutputError when it cannot be written."""
        try:
            self.root.mkdir(parents=True, exist_ok=True)
            held = {entry.name for entry in self.root.iterdir()} - {LOCK, WORK}
        except OSError as e:
            raise OutputError(f"cannot be written ({e.strerror})", where=self.root, do="choose another folder") from e
        if self.description.name in held:
            read_json(self.description, "dataset-1")
        elif held:
            raise InputError("holds files but no dataset.json", where=self.root, do="choose an empty folder")

    @contextmanager
    def locked(self) -> Iterator[int]:
        """Hold the dataset for this run and yield the lock's descriptor, which workers keep open too.

        Takes the folder back when nothing came of the run. InputError when another run has it.
        """
        lock = self._acquire()
        try:
            self.sweep()
            self.work.mkdir()
            yield lock
        finally:
            self.sweep()
            (self.root / LOCK).unlink(missing_ok=True)
            if not self.description.exists():
                with suppress(OSError):
                    self.root.rmdir()
            os.close(lock)

    def _acquire(self) -> int:
        give_up = time.monotonic() + LOCK_PATIENCE_S
        while True:
            try:
                lock = os.open(self.root / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
            except OSError as e:
                do = "choose another folder"
                raise OutputError(f"cannot be written ({e.strerror})", where=self.root, do=do) from e
            with suppress(OSError):
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # The run before may have removed the file between our opening and our locking it.
                if os.fstat(lock).st_ino == (self.root / LOCK).stat().st_ino:
                    return lock
            os.close(lock)
            if time.monotonic() > give_up:
                do = "wait for it, or end it"
                raise InputError("another run is writing this dataset", where=self.root, do=do)
            time.sleep(0.05)

    def sweep(self) -> None:
        """Remove the temporary files and folders of this run, or of one that was killed; nothing that is not ours."""
        shutil.rmtree(self.work, ignore_errors=True)
        for pattern in (f"*{TEMPORARY}*", f"*/*/*{TEMPORARY}*"):
            for path in self.root.glob(pattern):
                if path.relative_to(self.root).parts[0] != self.stage.name:
                    shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def write_atomically(path: Path, write: Callable[[Path], None], *, place: Callable[[str], Path] | None = None) -> str:
    """Let `write` fill a temporary file beside `path`, force it to disk, rename it, and return its sha256 (hex).

    It becomes `path`, or what `place` says of its sha256. There is never half a file. Raises OutputError, or the
    SpinError that `write` raises, leaving nothing.
    """
    temporary = _temporary(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(temporary)
        digest = _synced(temporary)
        final = place(digest) if place else path
        final.parent.mkdir(exist_ok=True)
        temporary.replace(final)
    except SpinError as e:
        temporary.unlink(missing_ok=True)
        raise type(e)(e.found, where=path, do=e.do) from e
    except OSError as e:
        temporary.unlink(missing_ok=True)
        raise _unwritten(path, e) from e
    return digest


def link_atomically(path: Path, source: Path) -> None:
    """Make `path` another name of the file `source`, or a copy of it where the file system has no links (or no more
    of that file). To replace either later leaves the other as it is. Raises OutputError, leaving nothing."""
    temporary = _temporary(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.unlink(missing_ok=True)
        try:
            temporary.hardlink_to(source)
        except OSError:
            shutil.copyfile(source, temporary)
            _synced(temporary)
        temporary.replace(path)
    except OSError as e:
        raise _unwritten(path, e) from e
    finally:
        temporary.unlink(missing_ok=True)  # to rename a file to another name of itself does nothing, by POSIX


def _temporary(path: Path) -> Path:
    return path.with_name(f"{path.stem}{TEMPORARY}{os.getpid()}{path.suffix}")


def _synced(path: Path) -> str:
    """Force the file to disk; returns its sha256."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        os.fsync(file.fileno())
    return digest


def _unwritten(path: Path, e: OSError) -> OutputError:
    do = "free some space or choose another folder"
    return OutputError(f"cannot be written ({e.strerror or e})", where=path, do=do)


def write_json(path: Path, value: Mapping[str, Any]) -> str:
    """`value` as JSON at `path`, atomically; returns its sha256."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    return write_atomically(path, lambda temporary: _write_text(temporary, text))


def sha256_of(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _write_text(path: Path, text: str) -> None:
    with path.open("w", encoding="utf-8") as file:
        file.write(text)

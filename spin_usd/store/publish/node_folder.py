"""A node's folder for a run into a URL: the stage, fetched once, and the files of its workers until they are published.

All workers of the run on that node share it, and with it its cache. The last worker that leaves removes it; remains of
killed workers are removed by the next run on the node.
"""

import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from spin_usd.errors import InputError, OutputError
from spin_usd.files.sha256 import sha256_of
from spin_usd.store.file_digests import SUMS, changed
from spin_usd.store.hidden_folder import LOCK, remove_leftovers
from spin_usd.store.lock import Lock, create_lock, take_alone, take_lock
from spin_usd.store.names import STAGE
from spin_usd.store.publish.dataset_url import DatasetUrl

NAME = "spin_usd-node"
PATIENCE_S = 5.0  # the last worker of those before may just be removing the folder


@contextmanager
def node_folder(run: str, url: DatasetUrl, sums: str) -> Iterator[Path]:
    """Share the node's folder of the run with that token, for as long as the block: a dataset's root with the stage.

    `sums`: the sha256 of the stage's list of digests. Raises InputError where the stage at `url` is not that one, and
    OutputError.
    """
    parent = Path(tempfile.gettempdir())
    folder = parent / f".{NAME}.{run}"
    try:
        remove_leftovers(parent, NAME)
        lock = _joined(folder, run)
    except OSError as e:
        raise OutputError(f"cannot be written ({e.strerror})", where=folder, do="look at the node's disk") from e
    try:
        _fetch_stage(folder, url, sums)
        yield folder / "dataset"
    finally:
        _leave(folder, lock)


def stage_sums(stage: Path) -> str:
    """Return the sha256 of the list of digests in a dataset's stage, which identifies every byte of it."""
    return sha256_of(stage / SUMS)


def _joined(folder: Path, run: str) -> Lock:
    give_up = time.monotonic() + PATIENCE_S
    while time.monotonic() < give_up:
        folder.mkdir(mode=0o700, exist_ok=True)
        with suppress(FileExistsError, FileNotFoundError):
            create_lock(folder / LOCK, run)
        if lock := take_lock(folder / LOCK, shared=True):
            return lock
        time.sleep(0.05)
    raise OutputError("is held by another program", where=folder, do="remove it")


def _fetch_stage(folder: Path, url: DatasetUrl, sums: str) -> None:
    """Fetch the stage, unless another worker has; meanwhile others wait."""
    root = folder / "dataset"
    with (folder / "fetching").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        if root.exists():
            return
        fetched = folder / "fetched"
        shutil.rmtree(fetched, ignore_errors=True)  # of a worker that was killed meanwhile
        url.fetch(url.names(STAGE), fetched)
        stage = fetched / STAGE
        if not (stage / SUMS).is_file() or stage_sums(stage) != sums or list(changed(stage)):
            raise InputError(
                "is not the stage of this run", where=f"{url.shown}/{STAGE}", do="stop other writers there"
            )
        fetched.rename(root)


def _leave(folder: Path, lock: Lock) -> None:
    """Leave the folder; remove it if no other worker uses it."""
    with suppress(OSError):
        if take_alone(lock):
            shutil.rmtree(folder, ignore_errors=True)
    os.close(lock.descriptor)

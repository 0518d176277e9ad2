"""A dataset's folder: names, what it may hold, and the hold of the one run that writes it.

dataset.json                         schema dataset-1
stage/                               the layers that made it
records/<variant>/<frame>.json       schema record-1, the index: written last, so a record means a finished picture
<kind>/<variant>/<frame>.<suffix>    image, depth, segmentation, dense_pose, radiance
cache/                               renders and labels by content (store.cache)
shards.json                          of shards: which picture is of which (planning.manifest)
.lock, .work-<token>/                of a run: its lock, and its temporary files, which the lock's token names
.lock-<I>-of-<N>, .lock-turn         of shards, which share .lock: each one's, and that of who changes what all share

These are a dataset's own; all else in the folder is its user's, and left alone.

A run holds its lock file for as long as a block takes; a killed run's hold ends with its last process. The lock is that
of `flock`. It holds between machines where the file system of a shared folder says so: NFS does (its version 3 with the
lock service), Lustre where it is mounted with `flock`. A file system without locks is refused.
"""

import errno
import os
import re
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from spin_usd.errors import InputError, OutputError
from spin_usd.files.changes import remove_tree
from spin_usd.files.folder import Folder
from spin_usd.files.node import Node, NodeType
from spin_usd.picture.make_picture import KINDS
from spin_usd.stop_signals import postponed
from spin_usd.store.json_schema import read_json
from spin_usd.store.lock import Lock, create_lock, new_token, refuse_other_file, take_alone, take_lock, token_in
from spin_usd.store.names import CACHE, DESCRIPTION, RECORDS, SHARDS, STAGE, is_record
from spin_usd.store.stage_path import ROOT_LAYER

OWN = (DESCRIPTION, STAGE, RECORDS, *KINDS, CACHE, SHARDS)
LOCK = ".lock"
TURN = ".lock-turn"
LOCK_OF_SHARD = re.compile(r"\.lock-[0-9]+-of-[0-9]+")
PATIENCE_S = 5.0  # a killed run's last worker needs a moment to die
FIRST_LOOK_S, LONGEST_LOOK_S = 0.05, 1.0  # between two looks: a hundred machines may wait for one file server
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)


@dataclass(frozen=True, kw_only=True)
class Lease:
    """A run's hold on a folder: the descriptors of its locks, which workers keep open too, and the folder of its
    temporary files."""

    descriptors: tuple[int, ...]
    work: Path


@dataclass(frozen=True, kw_only=True)
class Store:
    """The dataset in the folder `root`."""

    root: Path

    @property
    def folder(self) -> Folder:
        return Folder(self.root)

    @property
    def stage(self) -> Path:
        return self.root / STAGE

    @property
    def lock(self) -> Path:
        return self.root / LOCK

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of file that pictures have, or had."""
        return tuple(kind for kind in KINDS if self.folder.type_of(kind) is NodeType.FOLDER)

    def work(self, token: str) -> Path:
        """Temporary files of the run whose lock has that token; gone when none is running."""
        return self.root / f".work-{token}"

    def records(self) -> Iterator[str]:
        """The names of all records, ordered by variant and frame."""
        return filter(is_record, self.folder.files(RECORDS))

    def is_dataset(self) -> bool:
        """Return whether the folder holds a dataset, perhaps one that has lost its dataset.json."""
        if self.folder.type_of(DESCRIPTION) not in (None, NodeType.FOLDER):
            return True
        return all(self.folder.type_of(name) is NodeType.FOLDER for name in (STAGE, RECORDS))

    def prepare(self, *, special_files_stay: bool = False) -> None:
        """Look whether a run may write here: writes nothing. Raises InputError where the folder holds anything but a
        dataset, or, unless `special_files_stay`, one that `refuse_special_files` refuses; OutputError where it is not a
        folder, or cannot be read."""
        held = self.contents()
        if held and DESCRIPTION not in held:  # another shard may be starting or ending just now
            for lock in filter(_is_lock, held):
                await_token(self.root / lock)
            held = [name for name in self.contents() if name in {*held, DESCRIPTION}]
        if not held:
            return
        if DESCRIPTION not in held and not {STAGE, RECORDS} < set(held) <= {*OWN, LOCK}:
            stage = "is a stage, and a dataset's folder is expected" if ROOT_LAYER in held else None
            found = stage or f"holds {held[0]} but no {DESCRIPTION}"
            raise InputError(found, where=self.root, do="choose an empty folder")
        self._refuse_other_types() if special_files_stay else self.refuse_special_files()
        if DESCRIPTION in held:
            self._refuse_other_description()

    def _refuse_other_description(self) -> None:
        """Raise InputError where dataset.json is damaged or not a dataset's."""
        try:
            read_json(self.folder, DESCRIPTION, "dataset-1")
        except InputError as e:
            do = "if it is a dataset's, run spin-usd check --repair; if not, choose another folder"
            raise InputError(e.found, where=self.root / DESCRIPTION, do=do) from e

    def contents(self) -> list[str]:
        """Return the names in the folder, but those of a run that goes on or was killed. Raises OutputError where there
        is something that is not a folder, or cannot be read."""
        try:
            names = sorted(os.listdir(self.root))
        except FileNotFoundError:
            return []
        except OSError as e:
            raise OutputError(f"cannot be written ({e.strerror})", where=self.root, do="choose another folder") from e
        ours = {name for lock in names if _is_lock(lock) for name in self._under(lock)}
        return [name for name in names if name not in ours]

    def _under(self, lock: str) -> tuple[str, ...]:
        """Return the names of the lock and of the folder that was made under it; none where that is no lock of ours."""
        token = token_in(self.root / lock)
        return (lock, self.work(token).name) if token else ()

    def refuse_special_files(self) -> None:
        """Raise InputError where what should be the dataset's own is a link, or neither file nor folder: whatever that
        leads to is not the dataset's, and is neither read nor written nor removed."""
        refuse_special_files(self.folder, OWN)
        self._refuse_other_types()

    def _refuse_other_types(self) -> None:
        for name in OWN:
            wanted = NodeType.FILE if name in (DESCRIPTION, SHARDS) else NodeType.FOLDER
            if self.folder.type_of(name) not in (None, wanted):
                raise InputError(f"is not a {wanted}", where=self.root / name, do="move it elsewhere, or remove it")

    @contextmanager
    def locked(self, shard: str | None = None) -> Iterator[Lease]:
        """Hold the folder, which is made where there is none, for this run; with the name of a `shard`, "0-of-3",
        beside the runs of other shards.

        Takes a folder that it made back when nothing came of the run. Raises InputError when another run has it, and
        OutputError.
        """
        made = self._make_root()
        try:
            with ExitStack() as stack:
                busy = "another run is writing this dataset"
                whole = held(self.lock, busy=busy, shared=shard is not None, at_last=self._sweep_shards)
                locks = [stack.enter_context(whole)]
                if shard:
                    own = held(self.root / f".lock-{shard}", busy="another run is making this shard")
                    locks.append(stack.enter_context(own))
                else:
                    self._sweep_shards()
                work = self.work(locks[-1].token)
                stack.callback(self._remove_whole, work)
                self._sweep(work)
                yield Lease(descriptors=tuple(lock.descriptor for lock in locks), work=work)
        finally:
            if made:
                with suppress(OSError):  # not empty
                    self.root.rmdir()

    @contextmanager
    def exclusively(self) -> Iterator[None]:
        """Wait for the other shards that change what all shards of the dataset share, and hold them off. Raises
        OutputError."""
        with held(self.root / TURN, stays=True):
            yield

    def shards_at_work(self) -> Iterator[Path]:
        """Yield the work folders of the shards that are being made, this process' own among them."""
        for name in filter(LOCK_OF_SHARD.fullmatch, os.listdir(self.root)):
            if token := token_in(self.root / name):
                if lock := take_lock(self.root / name, shared=True):
                    os.close(lock.descriptor)
                else:
                    yield self.work(token)

    def _sweep_shards(self) -> None:
        """Remove what shards left, now that none is at work: locks, and temporary files of those that were killed."""
        for lock in filter(_is_lock, os.listdir(self.root)):
            if lock != LOCK and (ours := self._under(lock)):
                remove_tree(self.folder, ours[1])
                (self.root / lock).unlink(missing_ok=True)

    def _make_root(self) -> bool:
        """Make the folder, and return whether there was none."""
        try:
            self.root.parent.mkdir(parents=True, exist_ok=True)
            self.root.mkdir()
        except FileExistsError:
            return False
        except OSError as e:
            raise self._unwritable(e) from e
        return True

    def _sweep(self, work: Path) -> None:
        """Make the work folder anew, without what a run that was killed left in it."""
        try:
            if self.folder.type_of(work.name) is NodeType.FOLDER:
                remove_tree(self.folder, work.name)
            work.mkdir()
        except OSError as e:
            raise self._unwritable(e) from e

    def _remove_whole(self, work: Path) -> None:
        """Remove a work folder; a signal waits, for nobody would remove what is left of it."""
        with postponed():
            remove_tree(self.folder, work.name)

    def _unwritable(self, e: OSError) -> OutputError:
        return OutputError(f"cannot be written ({e.strerror})", where=self.root, do="choose another folder")


def refuse_dataset(out: Path, dataset: Path) -> None:
    """Raise InputError where the folder `out` lies in the dataset, which has files of its own there."""
    if out.resolve().is_relative_to(dataset.resolve()):
        raise InputError("lies in the dataset", where=out, do="choose a folder beside it")


def refuse_special_files(folder: Folder, names: tuple[str, ...]) -> None:
    """Raise InputError where one of these in the folder, or something below it, is neither file nor folder."""
    for node in folder.special_files(names):
        raise special_file_error(folder, node)


def special_file_error(folder: Folder, node: Node) -> InputError:
    """Return the error over something in the folder that is neither file nor folder."""
    do = "put what it stands for in its place, or remove it"
    return InputError(f"is a {node.type}, and those are not followed", where=folder.root / node.name, do=do)


def _is_lock(name: str) -> bool:
    return name in (LOCK, TURN) or LOCK_OF_SHARD.fullmatch(name) is not None


@contextmanager
def held(
    path: Path,
    *,
    busy: str | None = None,
    shared: bool = False,
    stays: bool = False,
    at_last: Callable[[], None] = lambda: None,
) -> Iterator[Lock]:
    """Hold the lock at `path`, made where there is none: alone, or `shared` with others that share it.

    Whoever holds it alone in the end calls `at_last` and removes it, unless it `stays`. While another run holds it this
    waits: for ever, or for PATIENCE_S seconds where `busy` is given, which is what the InputError says then. Raises
    OutputError.
    """
    try:
        lock = _acquired(path, busy, shared)
    except OSError as e:
        refuse_other_file(path)
        raise _unwritable(path, e) from e
    try:
        yield lock
    finally:
        if not stays and (not shared or take_alone(lock)):
            at_last()
            path.unlink(missing_ok=True)
        os.close(lock.descriptor)


def await_token(path: Path) -> None:
    """Wait at most PATIENCE_S seconds for an empty lock to be written: it was made an instant ago."""
    give_up = time.monotonic() + PATIENCE_S
    with suppress(OSError):
        while path.lstat().st_size == 0 and time.monotonic() < give_up:
            time.sleep(FIRST_LOOK_S)


def _acquired(path: Path, busy: str | None, shared: bool) -> Lock:
    began, pause = time.monotonic(), FIRST_LOOK_S
    while True:
        with suppress(FileExistsError):
            create_lock(path, new_token())
        if lock := take_lock(path, shared=shared):
            return lock
        if time.monotonic() > began + PATIENCE_S:
            refuse_other_file(path)
            if busy:
                raise InputError(busy, where=path.parent, do="wait for it, or end it")
        time.sleep(pause)
        pause = min(2 * pause, LONGEST_LOOK_S)


def _unwritable(path: Path, e: OSError) -> OutputError:
    if e.errno in NO_LOCKS:
        do = "mount it with locks (NFS with its lock service, Lustre with flock), or choose another folder"
        return OutputError(f"is on a file system without locks ({e.strerror})", where=path.parent, do=do)
    return OutputError(f"cannot be written ({e.strerror})", where=path.parent, do="choose another folder")

"""A dataset's folder: its names and contents, and the lock of the run that writes it."""

import errno
import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from spin_usd.basics.stop_signals import postponed
from spin_usd.errors import InputError, OutputError
from spin_usd.files.changes import remove_tree
from spin_usd.files.folder import Folder
from spin_usd.files.node import Node, NodeType
from spin_usd.picture.kinds import FILE_KINDS
from spin_usd.store.json_schema import read_json
from spin_usd.store.lock import Lock, create_lock, new_token, refuse_other_file, take_lock, token_in
from spin_usd.store.names import CACHE, DESCRIPTION, EVENTS, RECORDS, SHARDS, STAGE, is_record
from spin_usd.store.stage_path import ROOT_LAYER

OWN = (DESCRIPTION, STAGE, RECORDS, *FILE_KINDS, EVENTS, CACHE, SHARDS)
LOCK = ".lock"
PATIENCE_S = 5.0  # a killed run's last worker needs a moment to die
LOOK_EVERY_S = 0.05
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)


@dataclass(frozen=True, kw_only=True)
class Lease:
    """A run's hold on a folder."""

    descriptor: int
    """Of its lock, which workers keep open too."""
    work: Path
    """The folder of its temporary files."""


@dataclass(frozen=True, kw_only=True)
class Store:
    """The dataset in the folder `root`.

    dataset.json                         schema dataset-1
    stage/                               the layers that made it
    records/<variant>/<frame>.json       schema record-1, the index: written last, so a record means a finished picture
    <kind>/<variant>/<frame>.<suffix>    image, depth, segmentation, dense_pose, radiance
    events/<variant>.h5, .json           the events of a variant, and what they were made by (schema events-1)
    cache/                               renders and labels by content (store.cache)
    shards.json                          of a shard: what all shards make
    .lock, .work-<token>/                of a run: its lock, and its temporary files, which the lock's token names

    These belong to the dataset; anything else in the folder belongs to the user, and is left alone.
    """

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
        return tuple(kind for kind in FILE_KINDS if self.folder.type_of(kind) is NodeType.FOLDER)

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
        if LOCK in held and DESCRIPTION not in held:  # another run may be starting or ending just now
            _await_token(self.lock)
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
        """Return the names in the folder, except those of a running or killed run. Raises OutputError if it is not a
        folder, or cannot be read."""
        try:
            names = sorted(os.listdir(self.root))
        except FileNotFoundError:
            return []
        except OSError as e:
            raise OutputError(f"cannot be written ({e.strerror})", where=self.root, do="choose another folder") from e
        token = token_in(self.lock)
        ours = (LOCK, self.work(token).name) if token else ()
        return [name for name in names if name not in ours]

    def refuse_special_files(self) -> None:
        """Raise InputError if something that should belong to the dataset is a link, or neither file nor folder: its
        target is outside the dataset, and is neither read nor written nor removed."""
        refuse_special_files(self.folder, OWN)
        self._refuse_other_types()

    def _refuse_other_types(self) -> None:
        for name in OWN:
            wanted = NodeType.FILE if name in (DESCRIPTION, SHARDS) else NodeType.FOLDER
            if self.folder.type_of(name) not in (None, wanted):
                raise InputError(f"is not a {wanted}", where=self.root / name, do="move it elsewhere, or remove it")

    @contextmanager
    def locked(self) -> Iterator[Lease]:
        """Lock the folder, which is made if missing, for this run, as long as the block.

        A killed run's lock ends with its last process. The lock uses `flock`. It works between machines if the shared
        file system supports it: NFS does (version 3 with the lock service), Lustre if mounted with `flock`. A file
        system without locks is refused.

        Waits PATIENCE_S seconds for another run to release it. Removes a folder that it made if the run produced
        nothing. Raises InputError if another run keeps it, and OutputError.
        """
        made = self._make_root()
        try:
            with ExitStack() as stack:
                lock = self._acquired()
                stack.callback(os.close, lock.descriptor)
                stack.callback(self.lock.unlink, missing_ok=True)
                work = self.work(lock.token)
                stack.callback(self._remove_whole, work)
                self._replace_leftovers(work)
                yield Lease(descriptor=lock.descriptor, work=work)
        finally:
            if made:
                with suppress(OSError):  # not empty
                    self.root.rmdir()

    def _acquired(self) -> Lock:
        """Take the lock, which is made if missing."""
        began = time.monotonic()
        try:
            while True:
                with suppress(FileExistsError):
                    create_lock(self.lock, new_token())
                if lock := take_lock(self.lock):
                    return lock
                if time.monotonic() > began + PATIENCE_S:
                    refuse_other_file(self.lock)
                    found = "another run is writing this dataset"
                    raise InputError(found, where=self.root, do="wait for it, or end it")
                time.sleep(LOOK_EVERY_S)
        except OSError as e:
            refuse_other_file(self.lock)
            if e.errno not in NO_LOCKS:
                raise self._unwritable(e) from e
            do = "mount it with locks (NFS with its lock service, Lustre with flock), or choose another folder"
            raise OutputError(f"is on a file system without locks ({e.strerror})", where=self.root, do=do) from e

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

    def _replace_leftovers(self, work: Path) -> None:
        """Make the work folder anew, without remains of a killed run."""
        try:
            if self.folder.type_of(work.name) is NodeType.FOLDER:
                remove_tree(self.folder, work.name)
            work.mkdir()
        except OSError as e:
            raise self._unwritable(e) from e

    def _remove_whole(self, work: Path) -> None:
        """Remove a work folder; a signal waits, since nobody else would remove the rest."""
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
    do = "replace it by its target, or remove it"
    return InputError(f"is a {node.type}, which is not followed", where=folder.root / node.name, do=do)


def _await_token(path: Path) -> None:
    """Wait at most PATIENCE_S seconds for an empty lock to be written: it was made an instant ago."""
    give_up = time.monotonic() + PATIENCE_S
    with suppress(OSError):
        while path.lstat().st_size == 0 and time.monotonic() < give_up:
            time.sleep(LOOK_EVERY_S)

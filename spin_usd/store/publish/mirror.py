"""The supervisor's copy of a dataset at a URL, on this machine for the time of a run, and the run's marker there."""

import os
import platform
import secrets
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath

import psutil
from msgspec import Struct, json
from msgspec.structs import replace

from spin_usd.basics.nesting import typed_json
from spin_usd.errors import InputError, OutputError
from spin_usd.files.changes import make_folder, remove_file, write_bytes
from spin_usd.files.folder import Folder
from spin_usd.files.new_file import write_whole
from spin_usd.picture.kinds import FILE_KINDS
from spin_usd.records.record import Record
from spin_usd.store.dataset_folder import Store
from spin_usd.store.hidden_folder import hidden_folder
from spin_usd.store.names import DESCRIPTION, RECORDS, STAGE
from spin_usd.store.publish.dataset_url import MARKER, DatasetUrl, below
from spin_usd.store.read_documents import decoded_record, read_record, recorded_files

Snapshot = dict[str, tuple[int, int]]
"""The size and the time of change of files, by name."""

RENEWED_S = 20.0  # between two renewals of a run's marker
OVER_S = 120.0  # a run that has not renewed its marker for so long is over: some renewals may fail


class Mirror:
    """The copy in the folder of `store` of the dataset at `url`.

    It contains dataset.json, the stage and the records. The files of pictures have one byte: a run that resumes only
    checks that they exist and are not empty.
    """

    def __init__(self, store: Store, url: DatasetUrl) -> None:
        self.store, self.url = store, url
        self._published: Snapshot = {}

    def fetch(self) -> None:
        """Fill the folder, which is empty. Raises InputError where the URL cannot be read, OutputError."""
        if not self.url.whole:
            self.url.remove_leftovers()
        names = self.url.names()
        own = [DESCRIPTION, *below(names, STAGE), *below(names, RECORDS)]
        self.url.fetch([name for name in own if name in set(names)], self.store.root)
        try:
            for name in set(names) - set(own):
                self._stand_in(name)
        except OSError as e:
            raise OutputError(f"cannot be written ({e.strerror})", where=self.store.root, do="free some space") from e
        self._published = self._snapshot()

    def publish(self) -> None:
        """Make the URL equal to the folder: remove deleted files first, records before the files they describe, then
        add new or changed files, records last. Raises OutputError."""
        now = self._snapshot()
        for name in sorted(self._published.keys() - now.keys(), key=_is_record, reverse=True):
            self.url.remove(name)
        changed = [name for name in now if now[name] != self._published.get(name)]
        for name in sorted(changed, key=_is_record):
            self.url.put(name, self.store.root / name)
        self._published = now

    def _stand_in(self, name: str) -> None:
        make_folder(self.store.folder, PurePosixPath(name).parent.as_posix())
        write_bytes(self.store.folder, name, b"\n")

    def _snapshot(self) -> Snapshot:
        root = self.store.root
        names = [name for folder in (STAGE, RECORDS, *FILE_KINDS) for name in self.store.folder.files(folder)]
        if self.store.folder.type_of(DESCRIPTION):
            names.append(DESCRIPTION)
        status = ((name, (root / name).stat()) for name in names)
        return {name: (stat.st_size, stat.st_mtime_ns) for name, stat in status}


@contextmanager
def mirrored(url: str) -> Iterator[Mirror]:
    """Mirror the dataset at `url` in a temporary folder of this machine. Raises InputError, also where another run
    writes there, and OutputError."""
    there = DatasetUrl(url)
    with marked(there), hidden_folder(Path(tempfile.gettempdir()), "spin_usd-mirror") as hidden:
        mirror = Mirror(Store(root=hidden.folder / "dataset"), there)
        mirror.store.root.mkdir()
        mirror.fetch()
        yield mirror


def _is_record(name: str) -> bool:
    return name.startswith(f"{RECORDS}/")


class Marker(Struct, frozen=True, kw_only=True):
    """The marker of an active run: its token, machine and process, and the time of writing."""

    token: str
    host: str
    process: int
    time: float


@contextmanager
def marked(url: DatasetUrl) -> Iterator[None]:
    """Mark `url` as written by this run, as long as the block.

    Object stores have no locks, so a file warns a second run. Two runs that begin at the same moment may both continue:
    they write the same bytes, and work twice. Raises InputError if another run is active, and OutputError.
    """
    own = Marker(token=secrets.token_hex(8), host=platform.node(), process=os.getpid(), time=time.time())
    _refuse_other(url, own)
    _put(url, own)
    _refuse_other(url, own)  # which came between
    ended = threading.Event()
    renewing = threading.Thread(target=_renew, args=(url, own, ended), daemon=True)
    renewing.start()
    try:
        yield
    finally:
        ended.set()
        renewing.join()
        url.remove(MARKER)


def _renew(url: DatasetUrl, own: Marker, ended: threading.Event) -> None:
    while not ended.wait(RENEWED_S):
        with suppress(OutputError):  # the next one may succeed
            _put(url, own)


def _put(url: DatasetUrl, own: Marker) -> None:
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder:
        file = Path(folder) / MARKER
        write_whole(file, json.encode(replace(own, time=time.time())))
        url.put(MARKER, file)


def _refuse_other(url: DatasetUrl, own: Marker) -> None:
    """Raise InputError if a run is active whose marker has another token. A run on this machine is active if its
    process is, others by the time of the marker, since clocks of machines agree to seconds."""
    try:
        found = typed_json(url.read(MARKER) or b"{}", Marker)
    except ValueError:
        return  # none, or not written by a run
    on = psutil.pid_exists(found.process) if found.host == own.host else time.time() - found.time < OVER_S
    if found.token != own.token and on:
        said = f"is being written by another run (process {found.process} on {found.host})"
        do = f"wait for its end; {OVER_S:.0f} s after it was killed this run can resume"
        raise InputError(said, where=url.shown, do=do)


def publish_picture(root: Path, record: str, url: DatasetUrl) -> None:
    """Move the picture with the record of that name from the dataset's folder `root` to `url`.

    The old record is removed first, the new one is added last, then files that only the old one described are removed.
    Raises OutputError, and InputError if the record is not valid.
    """
    variant, frame = _picture_of(record)
    new = recorded_files(read_record(Folder(root), record), variant, frame)
    old = recorded_files(_old_record(url, record), variant, frame)
    if old:
        url.remove(record)
    for name in (*new.values(), record):
        url.put(name, Folder(root).path(name))
    for name in set(old.values()) - set(new.values()):
        url.remove(name)
    for name in (record, *new.values()):
        remove_file(Folder(root), name)


def _picture_of(record: str) -> tuple[str, str]:
    """Return the variant and the frame of the record of that name, which comes from a child and may be invalid."""
    match PurePosixPath(record).parts:
        case (folder, variant, file) if folder == RECORDS and file.endswith(".json"):
            return variant, file.removesuffix(".json")
    raise OutputError("is not the name of a record", where=record)


def _old_record(url: DatasetUrl, name: str) -> Record | None:
    with suppress(InputError):
        return decoded_record(url.read(name) or b"", Path(name))
    return None

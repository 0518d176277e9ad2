"""The cache of renders and labels by content: each is computed once and serves every picture of the dataset.

A picture's bytes are the same with any cache and with none: the whole folder may be deleted when no run is on.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from spin_usd.basics.arrays import digest
from spin_usd.errors import InputError
from spin_usd.files.changes import remove_emptied, remove_file
from spin_usd.files.folder import FileIn, Folder
from spin_usd.labels.table import LABELS
from spin_usd.picture.kinds import RENDERED
from spin_usd.picture.versions import IMAGING, LABELLING
from spin_usd.records.record import Record
from spin_usd.store.atomic import write_atomically
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import CACHE
from spin_usd.store.read_documents import read_record

RENDERS = "renders"
CACHED = (RENDERS, *LABELS)
MEASURED = f"{CACHE}/measured.json"  # beside them: the cost of passes in this dataset's runs (planning.cost)
VERSION_DIGITS = 8


@dataclass(frozen=True, kw_only=True)
class Purpose:
    """The use that a cached file is good for: its kind, the picture's key of that kind, and the software's digest."""

    kind: str
    key: str
    versions: str


@dataclass(frozen=True, kw_only=True)
class CacheEntry:
    """A cached file, the `sha256` that its bytes must have, and its purpose."""

    purpose: Purpose
    sha256: str
    file: FileIn

    @property
    def whole(self) -> bool:
        """Return whether the file is the one that was written."""
        with suppress(OSError, InputError):
            return self.file.folder.sha256(self.file.name) == self.sha256
        return False


@dataclass(frozen=True, kw_only=True)
class Cache:
    """The cache in a dataset's `folder`, for results of the software with these `versions`, names and numbers; `work`
    is for temporary files.

    cache/renders/<2>/<radiance key>.<versions>.<sha256>.exr    the target in unit light (picture.render_file)
    cache/<label>/<2>/<key>.<versions>.<sha256>.<...>           hard links of the pictures' own label files

    A label's key is the geometry key, or its own if it depends on more. <2> is the key's start, <versions> the start of
    a digest of the software that made it: a file of another Blender is never used. A file's name contains the digest of
    its bytes, so only files with their original bytes are used or removed; a damaged file is made again under the same
    name.
    """

    folder: Folder
    versions: Mapping[str, str]
    work: Path

    def find(self, kind: str, key: str) -> CacheEntry | None:
        """Find the file of that kind and key, every byte verified."""
        wanted = Purpose(kind=kind, key=key, versions=made_by(self.versions, kind))
        found = _entries(self.folder, f"{CACHE}/{kind}/{key[:2]}")
        return next((entry for entry in found if entry.purpose == wanted and entry.whole), None)

    def keep(
        self, kind: str, key: str, suffix: str, encode: Callable[[], bytes], *, also: str | None = None
    ) -> CacheEntry:
        """Keep a file of the bytes that `encode` returns, whose second name in the dataset is `also`. It is not forced
        to disk: a damaged one is found by its digest, and made again. Raises as write_atomically does."""
        purpose = Purpose(kind=kind, key=key, versions=made_by(self.versions, kind))

        def place(sha256: str) -> str:
            return f"{CACHE}/{kind}/{key[:2]}/{key}.{purpose.versions}.{sha256}{suffix}"

        named = f"{CACHE}/{kind}/{key}{suffix}"
        sha256 = write_atomically(self.folder, named, encode, work=self.work, place=place, also=also, forced=False)
        return CacheEntry(purpose=purpose, sha256=sha256, file=FileIn(self.folder, place(sha256)))


def made_by(versions: Mapping[str, str], kind: str) -> str:
    """Return the digest in the names of files of that `kind` from software of these versions, except the part that
    develops images. A label's excludes the renderer too, and includes its channels, since the same surface in other
    channels is another file."""
    if kind not in LABELS:
        return digest({name: number for name, number in versions.items() if name not in IMAGING})[:VERSION_DIGITS]
    labelling = {name: number for name, number in versions.items() if name in LABELLING}
    return digest(labelling, LABELS[kind].channels.header(kind))[:VERSION_DIGITS]


def entries(store: Store) -> Iterator[CacheEntry]:
    """Yield all files of the dataset's cache, unverified."""
    for kind in CACHED:
        yield from _entries(store.folder, f"{CACHE}/{kind}")


def held_keys(store: Store) -> dict[str, set[str]]:
    """Return keys by kind of the files in the dataset's cache, of any version, unverified: for estimates."""
    held: dict[str, set[str]] = {kind: set() for kind in CACHED}
    for entry in entries(store):
        held[entry.purpose.kind].add(entry.purpose.key)
    return held


def uses(record: Record) -> set[Purpose]:
    """Return the purposes that a picture with this `record` was, or could have been, made from."""
    keys, versions, kinds = record.provenance.keys, record.provenance.versions, set(record.files)
    of = {kind: keys.get(kind, keys["geometry"]) for kind in kinds & set(LABELS)}
    of |= {RENDERS: keys["radiance"]} if kinds & RENDERED else {}
    return {Purpose(kind=kind, key=key, versions=made_by(versions, kind)) for kind, key in of.items()}


def used(store: Store) -> set[Purpose]:
    """Return the purposes that all pictures of the dataset use; a damaged record uses nothing."""
    found: set[Purpose] = set()
    for name in store.records():
        with suppress(InputError):
            found |= uses(read_record(store.folder, name))
    return found


def remove_entries(store: Store, *, but: set[Purpose]) -> None:
    """Remove all files from the cache except those for these purposes, and the folders left empty. A file whose bytes
    do not match its name was not written under that name, and stays."""
    for entry in list(entries(store)):
        if entry.purpose not in but and entry.whole:
            remove_file(store.folder, entry.file.name)
            remove_emptied(store.folder, entry.file.name)


def _entries(folder: Folder, within: str) -> Iterator[CacheEntry]:
    """Yield the files of the cache in its folder `within`."""
    for name in folder.files(within):
        match name.split("/"):
            case [_, kind, start, file] if file.startswith(start):
                yield from _entry(FileIn(folder, name), kind, file)


def _entry(file: FileIn, kind: str, name: str) -> Iterator[CacheEntry]:
    match name.split("."):
        case [key, versions, sha256, _]:
            yield CacheEntry(purpose=Purpose(kind=kind, key=key, versions=versions), sha256=sha256, file=file)

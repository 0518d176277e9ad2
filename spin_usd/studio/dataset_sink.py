"""The files of a picture as a worker writes them: encoded, linked from the cache or stored there, and their record."""

from contextlib import suppress
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

from msgspec import to_builtins
from numpy.typing import NDArray

from spin_usd.errors import InputError
from spin_usd.files.changes import remove_file
from spin_usd.formats.array_file import encoded_array
from spin_usd.labels.table import LABELS
from spin_usd.picture.kinds import IMAGE, RADIANCE
from spin_usd.picture.render_file import RENDER_SUFFIX, encoded_render, read_render
from spin_usd.records.record import Record, RecordedFile
from spin_usd.scene.channels import Channels
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.store.atomic import link_atomically, write_atomically, write_json
from spin_usd.store.cache import RENDERS, Cache, CacheEntry
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import record_of
from spin_usd.store.read_documents import read_record, recorded_files


class DatasetSink:
    """Writes the files of pictures into the dataset of `store`. `work`: the folder of its temporary files."""

    def __init__(self, store: Store, cache: Cache, *, work: Path, image_suffix: str) -> None:
        self._store, self._cache, self._work, self._image_suffix = store, cache, work, image_suffix

    def found_label(self, kind: str, key: str) -> CacheEntry | None:
        """Find a label in the cache."""
        return self._cache.find(kind, key)

    def found_render(self, key: str, scene: Scene, *, groups: int) -> Radiance | None:
        """Read the render of a picture of `scene` from the cache; None if it has none."""
        entry = self._cache.find(RENDERS, key)
        return read_render(entry.file, scene.picture_region, groups=groups) if entry else None

    def keep_render(self, key: str, rendered: Radiance) -> None:
        """Store a render in the cache."""
        self._cache.keep(RENDERS, key, RENDER_SUFFIX, partial(encoded_render, rendered))

    def write(
        self, scene: Scene, kind: str, array: NDArray[Any], channels: Channels, *, key: str | None = None
    ) -> RecordedFile:
        """Write one file; with `key` it is a label that the cache stores too. Return its entry in the record."""
        name = self._name(scene, kind)
        encode = partial(encoded_array, array, PurePosixPath(name).suffix, kind=kind, channels=channels)
        if key is None:
            digest = write_atomically(self._store.folder, name, encode, work=self._work, forced=False)
        else:
            digest = self._cache.keep(kind, key, LABELS[kind].suffix, encode, also=name).sha256
        return RecordedFile(path=name, sha256=digest, **channels.described)

    def link(self, scene: Scene, cached: CacheEntry) -> RecordedFile:
        """Link one label from the cache; return its entry in the record."""
        kind = cached.purpose.kind
        name = self._name(scene, kind)
        link_atomically(self._store.folder, name, cached.file, work=self._work)
        return RecordedFile(path=name, sha256=cached.sha256, **LABELS[kind].channels.described)

    def _name(self, scene: Scene, kind: str) -> str:
        return f"{kind}/{scene.frame.variant}/{scene.frame.name}{_suffix_of(kind, self._image_suffix)}"

    def remove(self, file: RecordedFile) -> None:
        """Remove one file."""
        remove_file(self._store.folder, file.path)

    def withdraw(self, variant: str, frame: str) -> Record | None:
        """Remove a picture's old record, so that no record ever describes files being replaced; return it, None without
        a usable one."""
        name, record = record_of(variant, frame), None
        with suppress(InputError):
            record = read_record(self._store.folder, name)
        remove_file(self._store.folder, name)
        return record

    def write_record(self, record: Record, before: Record | None) -> None:
        """Write the record, and remove files that only the old record lists."""
        name = record_of(record.variant, record.frame)
        write_json(self._store.folder, name, to_builtins(record), work=self._work)
        had = recorded_files(before, record.variant, record.frame).values()
        for stale in set(had) - {file.path for file in record.files.values()}:
            remove_file(self._store.folder, stale)


def _suffix_of(kind: str, image_suffix: str) -> str:
    """Return the file name extension of a kind of file."""
    if kind == IMAGE:
        return image_suffix
    return ".exr" if kind == RADIANCE else LABELS[kind].suffix

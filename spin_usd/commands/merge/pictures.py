"""The pictures of all datasets that are merged, none of which may contradict another."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from spin_usd.commands.merge.file_transfer import repair_of
from spin_usd.commands.merge.merged_dataset import MergedDataset
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_RECORD
from spin_usd.nesting import finite_json
from spin_usd.store.names import picture_of, record_of
from spin_usd.store.recorded_settings import recorded_options, recorded_settings
from spin_usd.store.unfinished import recorded_files

AGAIN = "render that picture again, or leave that dataset out"


@dataclass(frozen=True, kw_only=True)
class MergedPicture:
    """A picture: its variant, its frame, and the dataset that it is taken from."""

    variant: str
    frame: str
    source: MergedDataset

    @property
    def name(self) -> str:
        """The name of its record in that dataset."""
        return record_of(self.variant, self.frame)

    @property
    def path(self) -> Path:
        """Where its record lies, for messages."""
        return self.source.store.root / self.name

    @property
    def data(self) -> bytes:
        """The bytes of its record. Raises InputError."""
        return self.source.store.folder.read(self.name, MAX_RECORD)

    def record(self) -> dict[str, Any]:
        """Read the record. Raises InputError where it is damaged, or not of this picture."""
        try:
            record = finite_json(self.data)
        except (InputError, ValueError, RecursionError):
            record = None
        if not isinstance(record, dict) or not recorded_files(record, self.variant, self.frame):
            raise InputError("is not this picture's record", where=self.path, do=repair_of(self.source.store.root))
        return record


@dataclass(kw_only=True)
class _Collected:
    """What was found so far: pictures by variant and frame, and how each variant's were rendered."""

    pictures: dict[tuple[str, str], MergedPicture] = field(default_factory=dict)
    settings: dict[str, tuple[Mapping[str, Any], Path]] = field(default_factory=dict)

    def add(self, picture: MergedPicture) -> None:
        record = picture.record()
        known = self.pictures.setdefault((picture.variant, picture.frame), picture)
        if known is not picture and known.data != picture.data:
            raise InputError(f"contradicts {known.path}", where=picture.path, do=AGAIN)
        settings = _settings(record, picture)
        usual, where = self.settings.setdefault(picture.variant, (settings, picture.path))
        if differing := [name for name in settings if settings[name] != usual[name]]:
            found = f"was rendered with another {' and another '.join(differing)} than {where}"
            raise InputError(found, where=picture.path, do=AGAIN)


def collect(sources: Sequence[MergedDataset], progress: Callable[[int, int], None]) -> list[MergedPicture]:
    """Return all pictures, each once, in the order of the datasets. Raises InputError where the same picture is not the
    same in two, or pictures of a variant were not rendered alike."""
    found = _Collected()
    records = [(source, picture_of(name)) for source in sources for name in source.store.records()]
    for done, (source, (frame, variant)) in enumerate(records):
        progress(done, len(records))
        found.add(MergedPicture(variant=variant, frame=frame, source=source))
    progress(len(records), len(records))
    return list(found.pictures.values())


def _settings(record: Mapping[str, Any], picture: MergedPicture) -> dict[str, Any]:
    """Return the settings of the picture's render, by name."""
    try:
        return vars(recorded_settings(record)) | recorded_options(record)
    except (KeyError, TypeError, InputError):
        do = repair_of(picture.source.store.root)
        raise InputError("does not say how it was rendered", where=picture.path, do=do) from None

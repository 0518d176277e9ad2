"""The records of a dataset read one after the other, the damaged ones too."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

from spin_usd.basics.progress import Progress
from spin_usd.commands.show.columns import leaves
from spin_usd.commands.show.options import ShowOptions
from spin_usd.commands.show.picture_keys import PictureKeys, keys_of
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.measures import measured
from spin_usd.reading.picture import Picture
from spin_usd.records.event_record import EventRecord
from spin_usd.scene.poses import FRAME_NAME
from spin_usd.store.names import record_of
from spin_usd.store.read_documents import read_event_record

NOT_FILTERED_BY = {"schema", "files", "frame", "variant"}  # the page has the last two itself


@dataclass(frozen=True, kw_only=True)
class ReadPicture:
    """A picture's entry on the page."""

    frame: str
    variant: str
    dataset: str = ""
    """Its folder."""
    picture: Picture | None = None
    """None where its record is damaged."""
    keys: PictureKeys = field(default_factory=PictureKeys)
    values: dict[str, float | str] = field(default_factory=dict)
    """By the names of columns."""
    fault: str = ""
    """Fault of the record; "" for none."""

    @property
    def record(self) -> str:
        """The name of its record."""
        return record_of(self.variant, self.frame)

    def faults(self, of_files: Mapping[str, str]) -> str:
        """Return all that is wrong with its record and its files; "" for nothing. Faults of files are given by key."""
        own = (of_files.get(key) for key in dict.fromkeys((self.keys.image, self.keys.labels, self.keys.events)) if key)
        return self.fault or "; ".join(dict.fromkeys(filter(None, own)))


def read_records(dataset: Dataset, request: ShowOptions, *, what: str, progress: Progress) -> Iterator[ReadPicture]:
    """Yield every picture of the dataset in order, and report progress as `what`."""
    events = {variant: _events_of(dataset, variant) for variant in {variant for _, variant in dataset.names}}
    for done, (frame, variant) in enumerate(dataset.names):
        progress(what, done, len(dataset))
        try:
            read = _read_picture(dataset.picture(frame, variant), frame, variant, request, events[variant])
            yield replace(read, dataset=str(dataset.root))
        except InputError as fault:
            yield ReadPicture(frame=frame, variant=variant, fault=f"{record_of(variant, frame)}: {fault.found}")
    progress(what, len(dataset), len(dataset))


def _events_of(dataset: Dataset, variant: str) -> EventRecord | None:
    """Return the entry of the variant's events; None if there are none, or their record is damaged."""
    with suppress(InputError):
        return read_event_record(Folder(dataset.root), variant)
    return None


def _read_picture(
    picture: Picture, frame: str, variant: str, request: ShowOptions, events: EventRecord | None
) -> ReadPicture:
    """Return the entry of the picture of that frame and variant, from its record's name. Raises InputError."""
    if (picture.frame, picture.variant) != (frame, variant):
        raise InputError(f"calls itself {picture.frame!r} of {picture.variant!r}")
    if not FRAME_NAME.fullmatch(frame):
        raise InputError("has a name that no frame can have")
    filtered = {name: value for name, value in picture.record.items() if name not in NOT_FILTERED_BY}
    return ReadPicture(
        frame=frame,
        variant=variant,
        picture=picture,
        keys=keys_of(picture, request, events),
        values={**dict(leaves(filtered)), **measured(picture)},
    )

"""The keys of a picture's files in a gallery: each is made from the digests in the record, so equal files are made
once, and existing files are not made again."""

import json
from collections.abc import Collection
from typing import Any, NamedTuple

from msgspec import Struct, to_builtins

from spin_usd.commands.show.data_file import file_key
from spin_usd.commands.show.gallery_folder import DATA, IMAGES, OF_TARGET, THUMBNAILS, file_of
from spin_usd.commands.show.options import ORIGINAL, ShowOptions
from spin_usd.processes.call import Call
from spin_usd.reading.picture import Picture
from spin_usd.records.event_record import EventRecord
from spin_usd.records.record import Record

FILES_VERSION = "picture-files-2"
"""Goes up when the same picture gets other files."""
IMAGE = "image"


class PictureKeys(NamedTuple):
    """The keys of a picture's files in a gallery."""

    image: str = ""
    """Key of the image with its thumbnails; "" without an image."""
    labels: str = ""
    """Key of the label data; "" without labels."""
    suffix: str = ".jpg"
    """The image's."""
    preview: str = ""
    """Kind of label for the thumbnail if there is no image; "" otherwise."""
    kinds: tuple[str, ...] = ()
    """The labels in the data."""
    events: str = ""
    """Key of the events that follow the picture; "" without events."""

    @property
    def names(self) -> dict[str, str]:
        """Names of the files in the gallery, by kind."""
        found = {}
        if self.image:
            found["thumbnail"] = file_of(THUMBNAILS, self.image, ".jpg")
            found["of_target"] = file_of(THUMBNAILS, self.image, f"{OF_TARGET}.jpg")
        if self.image and not self.preview:
            found["image"] = file_of(IMAGES, self.image, self.suffix)
        if self.labels:
            found["labels"] = file_of(DATA, self.labels, ".js")
        if self.events:
            found["events"] = file_of(DATA, self.events, ".js")
        return found

    def without(self, present: Collection[str]) -> "PictureKeys":
        """Return the same without the keys of files that are among those `present`."""
        lacking = {what for what, name in self.names.items() if name not in present}
        image = self.image if lacking - {"labels", "events"} else ""
        return self._replace(
            image=image,
            labels=self.labels if "labels" in lacking else "",
            events=self.events if "events" in lacking else "",
        )


class ShowPicture(Struct, frozen=True, kw_only=True):
    """The request for the files of a picture in a gallery."""

    dataset: str
    frame: str
    variant: str
    out: str
    """Folder of the gallery."""
    work: str
    """Folder for temporary files."""
    images: str
    """Size of the images, as ShowOptions has it."""
    keys: PictureKeys
    """Keys of the files that the gallery lacks."""


SHOW_PICTURE = Call("spin_usd.commands.show.in_child:write_picture_files", ShowPicture, dict[str, str])


def keys_of(picture: Picture, request: ShowOptions, events: EventRecord | None) -> PictureKeys:
    """Return the keys of the picture's files; `events`: its variant's events."""
    record = picture.recorded
    digests = {kind: file.sha256 for kind, file in record.files.items()}
    kinds = tuple(kind for kind in request.label_names if kind in digests)
    preview = "" if IMAGE in digests else next(iter(kinds), "")
    shown = digests.get(preview or IMAGE)
    original = request.images == ORIGINAL and not preview and record.files[IMAGE].path.endswith(".png")
    return PictureKeys(
        image=_key("image", request.images, shown, visible_boxes(record)) if shown else "",
        labels=_key("labels", {kind: digests[kind] for kind in kinds}, _geometry(picture)) if kinds else "",
        suffix=".png" if original else ".jpg",
        preview=preview,
        kinds=kinds,
        events=_key("events", events.sha256, picture.time_s) if events and _is_in(picture, events) else "",
    )


def _is_in(picture: Picture, events: EventRecord) -> bool:
    """Return whether events follow the picture."""
    return picture.time_s is not None and events.start <= picture.time_s < events.start + events.duration


def visible_boxes(record: Record) -> list[list[int]]:
    """Return the boxes around the visible part of each visible target."""
    return [box for target in record.targets if (box := target.box.visible)]


def _key(*made_of: Any) -> str:
    return file_key(FILES_VERSION.encode(), json.dumps(made_of).encode())


def _geometry(picture: Picture) -> Any:
    """Return the further input of the label data besides the labels: see `body_points`."""
    record, parts = picture.recorded, sorted((part.id, part.target) for part in picture.parts.values())
    return to_builtins((record.camera, [(target.id, target.pose) for target in record.targets], parts))

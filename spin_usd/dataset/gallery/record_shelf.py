"""The records in a gallery, some in a file: the page loads the file when it shows one of its pictures."""

from typing import Any

from spin_usd.dataset.gallery.data_file import DataFile
from spin_usd.dataset.gallery.gallery_folder import GalleryFolder
from spin_usd.dataset.gallery.survey import SurveyedPicture
from spin_usd.dataset.read.picture import Picture
from spin_usd.geometry.lens import invertible_radius

PER_FILE = 64  # half a megabyte of JSON, a tenth of it packed: they are much alike


class RecordShelf:
    """Writes the records of pictures into the folder as they come. `files`: their names, PER_FILE pictures in each."""

    def __init__(self, folder: GalleryFolder) -> None:
        self.files: list[str] = []
        self._folder, self._held = folder, list[dict[str, Any]]()

    def add(self, picture: SurveyedPicture) -> None:
        """Add the next picture."""
        self._held.append(_described(picture, picture.picture) if picture.picture else {})
        if len(self._held) == PER_FILE:
            self.finish()

    def finish(self) -> None:
        """Write those that fill no whole file."""
        if self._held:
            self.files.append(self._folder.add(DataFile({"pictures": self._held})))
            self._held = []


def _described(surveyed: SurveyedPicture, picture: Picture) -> dict[str, Any]:
    """Return what the page shows of the picture: its record, its files, and up to which radius its lens is one to
    one; None for an endless one."""
    radius = invertible_radius(picture.camera.distortion)
    limit = radius if radius < float("inf") else None
    return {"record": picture.record, "lens_limit": limit, "files": surveyed.keys.names}

"""The child's part of `show`: the files of one picture, for which it decodes those of the dataset."""

from collections.abc import Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.commands.show.in_child.label_file import label_file
from spin_usd.commands.show.options import ORIGINAL, SMALL
from spin_usd.commands.show.picture_keys import IMAGE, PictureKeys
from spin_usd.errors import InputError
from spin_usd.faults import reading
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.new_file import write_whole
from spin_usd.formats.arrays.image_file import write_image
from spin_usd.labels import preview
from spin_usd.labels.table import LABELS
from spin_usd.store.atomic import link_atomically, write_atomically
from spin_usd.store.description import Description, read_description
from spin_usd.store.names import record_of
from spin_usd.store.picture import Picture, read_picture

THUMBNAIL_PX, SMALL_PX = 256, 960
QUALITY = 85


def write_picture_files(
    *, dataset: str, frame: str, variant: str, out: str, work: str, images: str, keys: Sequence[Any]
) -> dict[str, str]:
    """Write the files of a picture that the gallery in the folder `out` lacks, those with `keys`, PictureKeys; return
    what is wrong with those of the dataset, by the keys that could not be written."""
    picture = read_picture(Path(dataset), record_of(variant, frame), _description(dataset))
    writer = _PictureWriter(picture, Folder(Path(out)), Path(work))
    return dict(writer.faults(PictureKeys(*keys), images))


@cache
def _description(dataset: str) -> Description:
    return read_description(Path(dataset))


class _PictureWriter:
    """Writes files of a picture into the folder `out` by way of `work`."""

    def __init__(self, picture: Picture, out: Folder, work: Path) -> None:
        self._picture, self._out, self._work = picture, out, work

    def faults(self, keys: PictureKeys, images: str) -> Iterator[tuple[str, str]]:
        """Write all, and yield each key that could not be written, and what is wrong."""
        shown = self._preview if keys.preview else self._image
        for key, write in ((keys.image, partial(shown, keys, images)), (keys.labels, partial(self._labels, keys))):
            try:
                with reading(f"{self._picture.frame} of {self._picture.variant}"):
                    if key:
                        write()
            except InputError as fault:
                yield (
                    key,
                    str(fault).replace(f"{self._picture.root}/", ""),
                )  # whoever is sent the page has no such folder

    def _image(self, keys: PictureKeys, images: str) -> None:
        shown = preview.image(self._picture.image)
        grey = self._picture.image.ndim == 2
        if images == ORIGINAL:
            source = FileIn(Folder(self._picture.root), self._picture.files[IMAGE].path)
            link_atomically(self._out, keys.names["image"], source, work=self._work, copy=True)
        else:
            self._jpeg(keys.names["image"], preview.reduced(shown, SMALL_PX) if images == SMALL else shown, grey=grey)
        self._jpeg(keys.names["thumbnail"], preview.reduced(shown, THUMBNAIL_PX), grey=grey)

    def _preview(self, keys: PictureKeys, images: str) -> None:
        label = LABELS[keys.preview].preview(self._picture.label(keys.preview))
        self._jpeg(keys.names["thumbnail"], preview.reduced(label, THUMBNAIL_PX), grey=False)

    def _labels(self, keys: PictureKeys) -> None:
        labels = {kind: self._picture.label(kind) for kind in keys.kinds}
        script = label_file(self._picture, labels).script(keys.labels)
        write_atomically(self._out, keys.names["labels"], partial(write_whole, data=script), work=self._work)

    def _jpeg(self, name: str, image: NDArray[np.uint8], *, grey: bool) -> None:
        pixels, channels = (image[..., 0], ("Y",)) if grey else (image, ("R", "G", "B"))
        write = partial(write_image, array=pixels, channels=channels, quality=QUALITY)
        write_atomically(self._out, name, write, work=self._work)

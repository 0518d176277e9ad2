"""The folder of a gallery while it is written."""

import re
from collections.abc import Collection
from pathlib import Path

from msgspec import to_builtins

from spin_usd import __version__
from spin_usd.basics.resources import PACKAGE
from spin_usd.commands.show.data_file import DataFile
from spin_usd.errors import InputError
from spin_usd.files.changes import remove_emptied, remove_file
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.records.descriptions import GalleryDescription
from spin_usd.store.atomic import write_atomically, write_json
from spin_usd.store.dataset_folder import Store, refuse_special_files
from spin_usd.store.json_schema import read_json

SCHEMA = "gallery-1"
INDEX_KEY = "index"
PAGE_FOLDER = PACKAGE / "commands" / "show" / "page"
PAGE = "index.html"
INDEX = "index.js"
SELF = "gallery.json"
PROGRAM = "page"
THUMBNAILS, IMAGES, DATA = "thumbnails", "images", "data"
BY_KEY = (THUMBNAILS, IMAGES, DATA)
OF_TARGET = "_target"
"""Suffix after the key for a thumbnail of the targets alone."""
OWN_NAME = re.compile(rf"(?:{'|'.join(BY_KEY)})/[0-9a-f]{{2}}/[0-9a-f]{{16}}(?:{OF_TARGET})?\.(?:jpg|png|js)")


def refuse_other(out: Path) -> None:
    """Raise InputError where the folder holds anything but a gallery, begun or finished, or a link in it. Write
    nothing."""
    held = Store(root=out).contents()
    if held and SELF not in held:
        raise InputError(f"holds {held[0]} but no {SELF}", where=out, do="choose an empty folder")
    if held:
        read_json(Folder(out), SELF, SCHEMA)
        refuse_special_files(Folder(out), (PAGE, INDEX, SELF, PROGRAM, *BY_KEY))


class GalleryFolder:
    """Writes into the folder `out`, through `work`. Files named by their keys stay unchanged."""

    def __init__(self, out: Path, work: Path) -> None:
        self.out, self.work = Folder(out), work
        self.present = {name for folder in BY_KEY for name in self.out.files(folder)}
        self._used = set[str]()

    def describe(self, dataset: Path) -> None:
        """Write the file that marks the folder's owner."""
        description = GalleryDescription(dataset=dataset.resolve().name, spin_usd=__version__)
        write_json(self.out, SELF, to_builtins(description), work=self.work)

    def add(self, data: DataFile) -> str:
        """Write a data file named by its key, unless it exists, and return its name."""
        name = file_of(DATA, data.key, ".js")
        if name not in self.present | self._used:
            self._write(name, data.script(data.key))
        self._used.add(name)
        return name

    def write_page(self, index: DataFile) -> None:
        """Write the index, the program, and at last the page that loads them."""
        self._write(INDEX, index.script(INDEX_KEY))
        for name, content in page_files().items():
            self._write(name if name == PAGE else f"{PROGRAM}/{name}", content)

    def remove_unused(self, used: Collection[str]) -> None:
        """Remove files called after keys that were there, and are neither among those `used` nor added."""
        for name in self.present - set(used) - self._used:
            if OWN_NAME.fullmatch(name):
                remove_file(self.out, name)
                remove_emptied(self.out, name)

    def total_bytes(self) -> int:
        """Return how large all files are together."""
        return sum(self.out.size(name) for name in self.out.files())

    def _write(self, name: str, content: bytes) -> None:
        write_atomically(self.out, name, lambda: content, work=self.work)


def page_files() -> dict[str, bytes]:
    """Return the files of the page by their names; index.html, which loads the others, is the last."""
    folder = Folder(PAGE_FOLDER)
    names = sorted(folder.files(), key=lambda name: (name.endswith(".html"), name))
    return {name: folder.read(name, MAX_DOCUMENT) for name in names}


def file_of(folder: str, key: str, suffix: str) -> str:
    """Return the name of the file with that key in one of the folders BY_KEY."""
    return f"{folder}/{key[:2]}/{key}{suffix}"

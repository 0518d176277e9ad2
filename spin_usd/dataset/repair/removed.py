"""A file that is made again, and stays where that fails."""

from collections.abc import Iterator
from contextlib import contextmanager

from spin_usd.files.changes import remove_file, write_bytes
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_DOCUMENT


@contextmanager
def removed(folder: Folder, name: str) -> Iterator[None]:
    """Remove the file `name`, if there is one, for the block to make it again; where that fails it comes back. Raises
    InputError where it is not a file, and OutputError."""
    before = folder.read(name, MAX_DOCUMENT) if folder.type_of(name) else None
    remove_file(folder, name)
    try:
        yield
    except BaseException:
        if before is not None and folder.type_of(name) is None:
            write_bytes(folder, name, before)
        raise

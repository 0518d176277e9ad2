"""Change the contents of a folder, following no link: make folders, put files into place, remove files."""

import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path

from spin_usd.errors import InputError, OutputError
from spin_usd.files.descriptor import checked
from spin_usd.files.folder import FOLDER_FLAGS, NO_LINK, FileIn, Folder, descend
from spin_usd.files.name import parts_of
from spin_usd.files.node import STRANGE, NodeType, type_of_mode
from spin_usd.files.size_limits import UNBOUNDED

WRITE_FLAGS = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | NO_LINK | getattr(os, "O_NONBLOCK", 0)


def put(folder: Folder, source: Path, name: str) -> None:
    """Move the file or folder `source`, on the same file system, to that `name`, in place of a file that has it, but of
    no link; the folders that lead there are made. Raises OSError."""
    *folders, last = parts_of(name, folder.root)
    holder = _made(folder.root, folders)
    try:
        with suppress(FileNotFoundError):
            if (type := type_of_mode(os.stat(last, dir_fd=holder, follow_symlinks=False).st_mode)) in STRANGE:
                raise FileExistsError(errno.EEXIST, f"there is a {type}")
        os.replace(source, last, dst_dir_fd=holder)
    finally:
        os.close(holder)


def write_bytes(folder: Folder, name: str, data: bytes) -> None:
    """Write the file `name` with this `data`, without waiting for a reader if it is a pipe. Raises OSError, and
    InputError if it is not a file."""
    *folders, last = parts_of(name, folder.root)
    holder = descend(folder.root, folders)
    try:
        descriptor = os.open(last, WRITE_FLAGS, 0o666, dir_fd=holder)
    finally:
        os.close(holder)
    with os.fdopen(checked(descriptor, UNBOUNDED, folder.root / name), "wb") as file:
        file.write(data)


def link(source: FileIn, path: Path) -> bool:
    """Make `path` another name of the file `source`, and return whether that succeeded. Raises InputError if the source
    is not a file."""
    with source.open() as file:
        *folders, last = parts_of(source.name, source.folder.root)
        with suppress(OSError):
            holder = descend(source.folder.root, folders)
            try:
                os.link(last, path, src_dir_fd=holder, follow_symlinks=False)
            finally:
                os.close(holder)
            if os.path.samestat(os.fstat(file.fileno()), path.lstat()):
                return True
            path.unlink()
    return False


def make_folder(folder: Folder, name: str) -> None:
    """Make the folder `name` and its parents, if missing. Raises OSError."""
    os.close(_made(folder.root, parts_of(name, folder.root)))


def remove_file(folder: Folder, name: str) -> None:
    """Remove the file `name`, if it exists. Raises OutputError if that fails, and InputError if it is not a file."""
    *folders, last = parts_of(name, folder.root)
    try:
        holder = descend(folder.root, folders)
    except FileNotFoundError:
        return
    except OSError as error:
        raise InputError(f"is reached over no folder ({error.strerror})", where=folder.root / name) from None
    try:
        if folder.type_of(name) not in (NodeType.FILE, None):
            raise InputError("is not a file", where=folder.root / name, do="inspect it, and remove it")
        with suppress(FileNotFoundError):
            os.unlink(last, dir_fd=holder)
    except OSError as error:
        found = f"cannot be removed ({error.strerror})"
        raise OutputError(found, where=folder.root / name, do="make it writable, and try again") from None
    finally:
        os.close(holder)


def remove_emptied(folder: Folder, name: str) -> None:
    """Remove the parent folders of `name`, from the innermost, as far as they are empty."""
    *folders, _ = parts_of(name, folder.root)
    with suppress(OSError):  # not empty
        while folders:
            *folders, last = folders
            holder = descend(folder.root, folders)
            try:
                os.rmdir(last, dir_fd=holder)
            finally:
                os.close(holder)


def remove_tree(folder: Folder, name: str) -> None:
    """Remove the folder `name` and its contents, links but not their targets; undeletable files stay."""
    *folders, last = parts_of(name, folder.root)
    with suppress(OSError):
        holder = descend(folder.root, folders)
        try:
            shutil.rmtree(last, ignore_errors=True, dir_fd=holder)
        finally:
            os.close(holder)


def _made(root: Path, folders: list[str]) -> int:
    """Make the folders that are not there, and open the innermost."""
    with suppress(FileNotFoundError):  # mostly they exist
        return descend(root, folders)
    os.makedirs(root, exist_ok=True)
    descriptor = os.open(root, FOLDER_FLAGS)
    for folder in folders:
        try:
            with suppress(FileExistsError):
                os.mkdir(folder, dir_fd=descriptor)
            inner = os.open(folder, FOLDER_FLAGS | NO_LINK, dir_fd=descriptor)
        finally:
            os.close(descriptor)
        descriptor = inner
    return descriptor

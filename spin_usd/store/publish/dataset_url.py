"""A dataset at a URL, through fsspec: in S3, in Google Cloud Storage, on any file system that fsspec knows.

Whatever is put there appears whole or not at all. An object store does that by itself; elsewhere a file is written
under a temporary name, and then renamed.
"""

import re
import secrets
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from spin_usd.errors import InputError, OutputError, SpinError
from spin_usd.files.url import to_install, without_password

WHOLE = {"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "oss", "memory"}  # readers never see a partial file
PART = re.compile(r".*\.[0-9a-f]{32}\.part")
MARKER = "run.json"  # of the run that writes there (run_marker.py); no file of the dataset

Answer = TypeVar("Answer")


class DatasetUrl:
    """The files of a dataset below `url`, by their names relative to that, with slashes. `shown`: the URL for messages,
    without a password."""

    def __init__(self, url: str) -> None:
        """Raises InputError where nothing here can open such a URL."""
        self.url, self.shown = url.rstrip("/"), without_password(url.rstrip("/"))
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise InputError(
                "needs fsspec, which is not installed", where=self.shown, do=f"run {to_install(url)}"
            ) from None
        try:
            self._files, root = url_to_fs(url)
        except (ImportError, ValueError) as error:  # a further library, such as s3fs; an unknown protocol
            do = f"run {to_install(url)}" if isinstance(error, ImportError) else "check how the URL begins"
            raise InputError(f"cannot be opened ({without_password(str(error))})", where=self.shown, do=do) from error
        self._root = str(root).rstrip("/")
        protocol = self._files.protocol
        self.whole = bool(WHOLE & ({protocol} if isinstance(protocol, str) else set(protocol)))

    def names(self, within: str = "") -> list[str]:
        """Return the names of all files of the dataset, or of those in the folder `within`, in order. Raises
        InputError."""
        listed = self._listed(within)
        return [name for name in listed if is_below(name) and not PART.fullmatch(name) and name != MARKER]

    def remove_leftovers(self) -> None:
        """Remove partial files of a killed run; no other run may be active. Raises InputError and OutputError."""
        for name in filter(PART.fullmatch, self._listed("")):
            self.remove(name)

    def fetch(self, names: Sequence[str], folder: Path) -> None:
        """Copy these files to the same names in `folder`. Raises InputError."""
        for name in names:
            if not is_below(name):
                raise InputError(f"is not the name of a file in a dataset ({name!r})", where=self.shown)
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
        for name in names:  # one at a time: of several fsspec takes [ and * in names for patterns
            place = str(folder / name)
            self._tried("read", InputError, partial(self._files.get_file, self._path(name), place))

    def read(self, name: str) -> bytes | None:
        """Return the file's contents; None if it does not exist. Raises InputError."""
        try:
            return self._tried("read", InputError, lambda: bytes(self._files.cat_file(self._path(name))))
        except InputError as error:
            if isinstance(error.__cause__, FileNotFoundError):
                return None
            raise

    def put(self, name: str, file: Path) -> None:
        """Make a copy of `file` the file of that name. Raises OutputError."""
        self._tried("written", OutputError, lambda: self._put(name, file))

    def remove(self, name: str) -> None:
        """Remove the file of that name, if there is one. Raises OutputError."""
        try:
            self._tried("removed", OutputError, lambda: self._files.rm_file(self._path(name)))
        except OutputError as error:
            if not isinstance(error.__cause__, FileNotFoundError):
                raise

    def _put(self, name: str, file: Path) -> None:
        path = self._path(name)
        if self.whole:
            self._files.put_file(str(file), path)
            return
        self._files.makedirs(path.rpartition("/")[0], exist_ok=True)
        part = f"{path}.{secrets.token_hex(16)}.part"
        self._files.put_file(str(file), part)
        self._files.mv(part, path)

    def _listed(self, within: str) -> list[str]:
        folder = self._path(within) if within else self._root
        found = self._tried("read", InputError, lambda: self._files.find(folder, refresh=True))
        return sorted(str(path)[len(self._root) + 1 :] for path in found)

    def _path(self, name: str) -> str:
        return f"{self._root}/{name}"

    def _tried(self, what: str, kind: type[SpinError], ask: Callable[[], Answer]) -> Answer:
        """Return the answer. Each store's library has errors of its own, and none of them is ours."""
        try:
            return ask()
        except Exception as error:
            found = f"cannot be {what} ({type(error).__name__}: {without_password(str(error))})"
            raise kind(found, where=self.shown, do="check the URL, the network and your rights there") from error


def is_below(name: str) -> bool:
    """Return whether `name`, which may be hostile, leads from a folder to a file below it."""
    return "\0" not in name and not {"", ".", ".."} & set(name.split("/"))


def below(names: Iterable[str], folder: str) -> list[str]:
    """Return the names that are in the folder."""
    return [name for name in names if name.startswith(f"{folder}/")]

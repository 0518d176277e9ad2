"""URLs, and remedies for a URL in place of a path, or a mistyped one.

A path is nearly any text: a URL taken for a path would silently become a folder of that name. So text that begins like
a URL is one; a folder with such a name needs its absolute path.
"""

import re
from pathlib import Path

from spin_usd.errors import InputError

PACKAGES = {
    "s3": "s3fs",
    "s3a": "s3fs",
    "gs": "gcsfs",
    "gcs": "gcsfs",
    "abfs": "adlfs",
    "abfss": "adlfs",
    "az": "adlfs",
    "oss": "ossfs",
    "hdfs": "pyarrow",
    "sftp": "paramiko",
    "ssh": "paramiko",
    "http": "aiohttp",
    "https": "aiohttp",
    "ftp": None,
    "file": None,
    "memory": None,
}
"""Packages that fsspec needs to open URLs, by scheme; None if it needs none."""

_URL = re.compile(r"(?:[a-z][a-z0-9+.-]+::)*([a-z][a-z0-9+.-]+)://(/*)[^/].*", re.DOTALL | re.IGNORECASE)
_BEGINNING = re.compile(r"([a-z][a-z0-9+.-]+):", re.IGNORECASE)  # one letter is a drive
_LOCAL = re.compile(r"file:(?://)?(/[^/].*)", re.DOTALL | re.IGNORECASE)
_WRITTEN = ("out", "folder")  # the arguments that name a folder to write; all others are read
_COPY = "(aws s3 sync, gcloud storage rsync)"


def without_password(url: str) -> str:
    """Return the URL as it may be printed: without the password of a user in it."""
    return re.sub(r"(//[^/@:]*):[^/@]*@", r"\1:***@", url)


def is_url(given: str | Path) -> bool:
    """Return whether that is a URL, not a path. Raises InputError for a mistyped URL."""
    scheme = _scheme(given)
    if scheme is None:
        return False
    found = _URL.fullmatch(given) if isinstance(given, str) else None
    if found and (found[1] != "file" or found[2]):
        return True
    form = "file:///FOLDER" if scheme == "file" else f"{scheme}://PLACE/FOLDER"
    do = f"write {form}, or the absolute path of a folder that is called so"
    raise InputError("is neither a URL nor a path", where=given, do=do)


def refuse_unless_path(given: str | Path, name: str) -> None:
    """Raise InputError where the argument called `name` is empty, or is a URL."""
    if given == "":
        raise InputError(f"{name} is ''", do="make it a path; the current folder is '.'")
    if _scheme(given):
        raise InputError("is a URL, and a path is expected", where=given, do=_instead(str(given), name))


def _instead(url: str, name: str) -> str:
    """Return the remedy for an argument `name` that is a URL: the expected value, or a way to get a folder."""
    if local := _LOCAL.fullmatch(url):
        return f"give {local[1]}"
    if name.removeprefix("--") in _WRITTEN:
        return f"give a folder, and copy that there afterwards {_COPY}"
    return f"fetch it to a folder first {_COPY}"


def to_install(url: str) -> str:
    """Return the command that installs what opens this URL."""
    found = _URL.fullmatch(url)
    package = PACKAGES.get(found[1].lower()) if found else None
    return f"pip install fsspec {package}" if package else "pip install fsspec"


def _scheme(given: str | Path) -> str | None:
    """Return the scheme of text that begins like a URL: with a known one, or with "NAME:/" or "NAME::"."""
    text = str(Path(given))  # ./s3:/x is s3:/x once it is a Path
    found = _BEGINNING.match(text)
    if not found or not (found[1].lower() in PACKAGES or text[found.end() :][:1] in ("/", ":")):
        return None
    return found[1]

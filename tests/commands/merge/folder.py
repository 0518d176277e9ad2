"""A dataset's folder as it is compared with another."""

from pathlib import Path


def content(folder):
    """The bytes of every file by name; of the cache only what is kept by content, for times differ."""
    files = (path for path in Path(folder).rglob("*") if path.is_file())
    named = {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}
    return {name: data for name, data in named.items() if name.count("/") > 1 or not name.startswith("cache/")}

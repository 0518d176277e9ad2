"""A user's own maps of the Earth: which file of a folder is which."""

from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.files.given_file import open_file
from spin_usd.files.size_limits import MAX_TEXTURE

SUFFIXES = (".jpg", ".jpeg", ".png", ".exr")
KINDS = {"albedo": ("albedo",), "clouds": ("cloud",), "night": ("night", "lights", "black", "dnb")}
"""What a map shows, and the words for it in files' names: the first kind of which a name holds one, else the albedo.

Maps of lights by night are called after NASA's Black Marble, and the day/night band (DNB) in which they are taken."""


def earth_maps(given: str | Path) -> dict[str, Path]:
    """Return the maps in a folder, or the map in a file, by what they show: albedo, clouds, night.

    Raises InputError for a folder without maps or with two of a kind, and for a file that is not a map.
    """
    path = Path(given)
    maps: dict[str, Path] = {}
    for file in _files(path):
        kind = _kind(file.stem.lower())
        if kind in maps:
            found = f"has two maps of {kind}, {maps[kind].name} and {file.name}"
            raise InputError(found, where=path, do="keep one; names with cloud or night say which is which")
        open_file(file, MAX_TEXTURE).close()  # so that no library opens a pipe, or what fills the memory
        maps[kind] = file
    return maps


def _kind(name: str) -> str:
    return next((kind for kind, words in KINDS.items() if any(word in name for word in words)), "albedo")


def _files(path: Path) -> list[Path]:
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES)
        if not files:
            raise InputError("holds no map of the Earth", where=path, do=f"put {', '.join(SUFFIXES)} files there")
        return files
    if path.suffix.lower() not in SUFFIXES:
        do = f"give a folder, or one of {', '.join(SUFFIXES)}"
        raise InputError("is not a map of the Earth that is read", where=path, do=do)
    return [path]

"""The tags that people gave to pictures: the file tags.json in a dataset's folder, which the page of `show` writes."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.store.json_schema import read_json

TAGS = "tags.json"
SCHEMA = "tags-1"
FORM = '{"schema": "tags-1", "dataset": "NAME", "tags": {"good": ["nominal/img000001"]}}'


def read_tags(path: Path) -> Mapping[str, Sequence[str]]:
    """Return the pictures of each tag in the file, as VARIANT/FRAME. Raises InputError."""
    try:
        tags: Mapping[str, Sequence[str]] = read_json(Folder(path.parent), path.name, SCHEMA)["tags"]
    except InputError as e:
        do = f"write it like {FORM}, or save it on the page of spin-usd show"
        raise InputError(e.found, where=e.where, do=do) from e
    return tags


def joined(paths: Iterable[Path]) -> dict[str, list[str]]:
    """Return the pictures of each tag in any of the files, each once. Raises InputError."""
    found: dict[str, dict[str, None]] = {}
    for tag, pictures in chain.from_iterable(read_tags(path).items() for path in paths):
        found.setdefault(tag, {}).update(dict.fromkeys(pictures))
    return {tag: [*pictures] for tag, pictures in found.items()}


def tagged(path: Path, names: Sequence[str]) -> set[tuple[str, str]]:
    """Return the pictures, (frame, variant), that have one of these tags by the file. Raises InputError if there is no
    file, or it lacks one of them."""
    if not path.is_file():
        do = "save tags.json there from the page of spin-usd show, or name another with --tags-file"
        raise InputError("is missing: no picture has a tag", where=path, do=do)
    tags = read_tags(path)
    for name in names:
        if not tags.get(name):
            held = ", ".join(sorted(tag for tag, pictures in tags.items() if pictures))
            do = f"choose among {held}" if held else "tag pictures on the page of spin-usd show"
            raise InputError(f"gives no picture the tag {name!r}", where=path, do=do)
    pictures = [picture.partition("/") for name in names for picture in tags[name]]
    return {(frame, variant) for variant, _, frame in pictures}

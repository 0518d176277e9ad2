"""Which pictures of a dataset are to be made again, by what `check` found."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import PurePosixPath
from typing import Any

from spin_usd.dataset.check.strays import STRAY
from spin_usd.dataset.picture.make_picture import KINDS
from spin_usd.dataset.store.cache import Purpose, entries, uses
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.dataset.store.names import CACHE, RECORDS, STAGE, picture_of
from spin_usd.errors import InputError
from spin_usd.files.node import Node
from spin_usd.scene.finding import ERROR, Finding

Records = Mapping[str, Mapping[str, Any]]
"""Valid records (record-1) by their pictures' names, "variant/frame"."""


def valid_records(store: Store) -> Records:
    """Read the dataset's records, but those that are damaged."""
    found: dict[str, Mapping[str, Any]] = {}
    for name in store.records():
        with suppress(InputError):
            frame, variant = picture_of(name)
            found[f"{variant}/{frame}"] = read_json(store.folder, name, "record-1")
    return found


def damaged_pictures(store: Store, findings: Iterable[Finding], records: Records) -> set[str]:
    """Return the names of pictures that something is wrong with: of their record, of a file, or of what they use of the
    cache; and of those whose files no record lists."""
    listed = list(findings)
    wrong = (finding.where for finding in listed if finding.severity == ERROR or finding.code == STRAY)
    found = {name for where in wrong for name in _of_file(where)}
    damaged = {finding.where for finding in listed if finding.where.startswith(f"{CACHE}/")}
    return found | set(_users(store, damaged, records))


def obstacle(name: str, strange: Iterable[Node]) -> Node | None:
    """Return what keeps the picture of that name from being made again: a link or the like in place of one of its own
    files, of a folder of the dataset, or in the stage. None where nothing does."""
    return next((node for node in strange if _is_shared(node.name) or name in _of_file(node.name)), None)


def _is_shared(name: str) -> bool:
    """Return whether what has that name serves many pictures: a file of one alone lies below two folders, and in the
    cache below three."""
    first, depth = name.partition("/")[0], name.count("/")
    return first == STAGE or depth < (3 if first == CACHE else 2)


def _of_file(name: str) -> Iterator[str]:
    """Yield the picture that has this file, where one of a dataset's pictures could have it."""
    match PurePosixPath(name).parts:
        case [kind, variant, file] if kind in (*KINDS, RECORDS):
            yield f"{variant}/{PurePosixPath(file).stem}"


def _users(store: Store, damaged: set[str], records: Records) -> Iterator[str]:
    """Yield one picture for each damaged file of the cache that some picture uses: that makes it again."""
    user: dict[Purpose, str] = {purpose: name for name, record in records.items() for purpose in uses(record)}
    for entry in entries(store):
        if entry.file.name in damaged and entry.purpose in user and not entry.whole:
            yield user[entry.purpose]

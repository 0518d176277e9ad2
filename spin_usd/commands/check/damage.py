"""Damage of a dataset, by its records: pictures, layers of the stage, and the list of these layers."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import PurePosixPath

from spin_usd.commands.check.digests import RENDER_AGAIN
from spin_usd.commands.check.recorded_requests import Records
from spin_usd.commands.check.strays import STRAY
from spin_usd.errors import InputError
from spin_usd.files.node import Node, NodeType
from spin_usd.picture.kinds import FILE_KINDS
from spin_usd.scene.finding import ERROR, Finding
from spin_usd.store.atomic import write_text
from spin_usd.store.cache import Purpose, entries, uses
from spin_usd.store.dataset_folder import Store
from spin_usd.store.file_digests import has_list, sums, unlisted
from spin_usd.store.names import CACHE, EVENTS, RECORDS, STAGE
from spin_usd.store.stage_layers import STAGE_SUMS


def damaged_pictures(store: Store, findings: Iterable[Finding], records: Records) -> set[str]:
    """Return the names of pictures with a damaged record, file or cache entry, and of pictures whose files no record
    lists."""
    listed = list(findings)
    wrong = (finding.where for finding in listed if finding.severity == ERROR or finding.code == STRAY)
    found = {name for where in wrong for name in _of_file(where)}
    damaged = {finding.where for finding in listed if finding.where.startswith(f"{CACHE}/")}
    return found | set(_users(store, damaged, records))


def obstacle(name: str, strange: Iterable[Node]) -> Node | None:
    """Return the obstacle to making the picture of that name again: a link or the like in place of one of its files, of
    a folder of the dataset, or in the stage. None if there is none."""
    return next((node for node in strange if _is_shared(node.name) or name in _of_file(node.name)), None)


def _is_shared(name: str) -> bool:
    """Return whether the file of that name serves many pictures: a single picture's file lies below two folders, and in
    the cache below three; events serve none."""
    first, depth = name.partition("/")[0], name.count("/")
    return first == STAGE or (first != EVENTS and depth < (3 if first == CACHE else 2))


def _of_file(name: str) -> Iterator[str]:
    """Yield the picture that has this file, where one of a dataset's pictures could have it."""
    match PurePosixPath(name).parts:
        case [kind, variant, file] if kind in (*FILE_KINDS, RECORDS):
            yield f"{variant}/{PurePosixPath(file).stem}"


def _users(store: Store, damaged: set[str], records: Records) -> Iterator[str]:
    """Yield one picture for each damaged file of the cache that some picture uses: that makes it again."""
    user: dict[Purpose, str] = {purpose: name for name, record in records.items() for purpose in uses(record)}
    for entry in entries(store):
        if entry.file.name in damaged and entry.purpose in user and not entry.whole:
            yield user[entry.purpose]


def altered_layer(store: Store, records: Records) -> str | None:
    """Return the name of a layer whose bytes are in no record; None if there is none. Pictures made of it would differ,
    and their new records would confirm it."""
    known, folder = _known(records), store.folder
    there = {name for name in known if folder.type_of(name) is NodeType.FILE}
    return next((name for name in sorted(known) if name not in there or folder.sha256(name) not in known[name]), None)


def listed_again(store: Store, records: Records) -> Iterator[str]:
    """Write SHA256SUMS again if it is lost or damaged, and yield its name. Raises InputError, without the list's name,
    if no record confirms a file that the list lacks."""
    known, folder = _known(records), store.folder
    if folder.type_of(STAGE) is not NodeType.FOLDER:
        return
    names = [path.relative_to(store.root).as_posix() for path in unlisted(store.stage)]
    unsure = [name for name in names if folder.sha256(name) not in known[name]]
    if has_list(store.stage) and unsure == names:  # the files are wrong, if any
        return
    if unsure:
        found = f"cannot be written again: no record confirms that {unsure[0]} is as it was"
        raise InputError(found, do=RENDER_AGAIN)
    with store.locked() as lease:
        write_text(folder, STAGE_SUMS, sums(store.stage), work=lease.work)
    yield STAGE_SUMS


def _known(records: Records) -> defaultdict[str, set[str]]:
    """Return the digests that each layer had when pictures were made of it."""
    known = defaultdict[str, set[str]](set)
    for record in records.values():
        for name, sha256 in record.provenance.stage.layers:
            known[name].add(sha256)
    return known

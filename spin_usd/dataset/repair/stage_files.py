"""The files of a dataset's stage: what records say of them, and their list."""

from collections import defaultdict
from collections.abc import Iterator

from spin_usd.dataset.check.provenance import RENDER_AGAIN
from spin_usd.dataset.repair.damage import Records
from spin_usd.dataset.store.atomic import write_text
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.file_digests import has_list, sums, unlisted
from spin_usd.dataset.store.names import STAGE
from spin_usd.dataset.store.stage_layers import STAGE_SUMS, layers_of
from spin_usd.errors import InputError
from spin_usd.files.node import NodeType


def altered_layer(store: Store, records: Records) -> str | None:
    """Return the name of a layer that no record knows as it is; None where there is none. Pictures made of it would be
    others, and their new records would vouch for it."""
    known, folder = _known(records), store.folder
    there = {name for name in known if folder.type_of(name) is NodeType.FILE}
    return next((name for name in sorted(known) if name not in there or folder.sha256(name) not in known[name]), None)


def listed_again(store: Store, records: Records) -> Iterator[str]:
    """Write SHA256SUMS again where it is lost or damaged, and yield its name. Raises InputError, which leaves the
    list's name to who calls, where no record says of a file that the list lacks that this is as it was."""
    known, folder = _known(records), store.folder
    if folder.type_of(STAGE) is not NodeType.FOLDER:
        return
    names = [path.relative_to(store.root).as_posix() for path in unlisted(store.stage)]
    unsure = [name for name in names if folder.sha256(name) not in known[name]]
    if has_list(store.stage) and unsure == names:  # the files are wrong, if any
        return
    if unsure:
        found = f"cannot be written again: no record says that {unsure[0]} is as it was"
        raise InputError(found, do=RENDER_AGAIN)
    with store.locked() as lease:
        write_text(folder, STAGE_SUMS, sums(store.stage), work=lease.work)
    yield STAGE_SUMS


def _known(records: Records) -> defaultdict[str, set[str]]:
    """Return the digests that each layer had when pictures were made of it."""
    known = defaultdict[str, set[str]](set)
    for record in records.values():
        for name, sha256 in layers_of(record["provenance"]["stage"]):
            known[name].add(sha256)
    return known

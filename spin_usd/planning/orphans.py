"""Find and remove pictures that a dataset holds and its stage does not: of another stage, or of a removed frame."""

from collections.abc import Sequence
from contextlib import suppress

from spin_usd.basics.pluralise import pluralise
from spin_usd.errors import InputError
from spin_usd.files.changes import remove_emptied, remove_file
from spin_usd.planning.make_plan import Plan
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import event_record_of, events_of, picture_of
from spin_usd.store.read_documents import read_record, recorded_files

SHOWN = 3


def orphaned_pictures(store: Store, plan: Plan) -> list[str]:
    """Return the records of pictures that are in the dataset and not in the whole stage."""
    names, variants = set(plan.names), set(plan.known_variants)
    pictures = ((record, *picture_of(record)) for record in store.records())
    return [record for record, frame, variant in pictures if frame not in names or variant not in variants]


def refuse(store: Store, orphans: Sequence[str]) -> None:
    """Raise InputError if there are any."""
    if orphans:
        do = "choose another folder, or add --prune, which removes them"
        raise InputError(in_words(orphans), where=store.root, do=do)


def in_words(orphans: Sequence[str]) -> str:
    """Return a message that names the pictures of these records."""
    shown = map(picture_of, orphans[:SHOWN])
    names = ", ".join(f"{variant}/{frame}" for frame, variant in shown)
    more = ", ..." if len(orphans) > SHOWN else ""
    return f"holds {pluralise(len(orphans), 'picture')} that this stage does not have ({names}{more})"


def remove(store: Store, orphans: Sequence[str]) -> None:
    """Remove the pictures of these records, and the events of variants without other pictures: each record first, so
    that none ever describes missing files, then its files, and the empty folders. Raises InputError, having removed
    nothing, if one is not a record, and OutputError."""
    pictures = [(record, *_files_of(store, record)) for record in orphans]
    kept = {variant for _, variant in map(picture_of, set(store.records()).difference(orphans))}
    emptied = {variant for _, variant in map(picture_of, orphans)} - kept
    for names in (*pictures, *((event_record_of(variant), events_of(variant)) for variant in sorted(emptied))):
        for name in names:
            remove_file(store.folder, name)
        for name in names:
            remove_emptied(store.folder, name)


def _files_of(store: Store, record: str) -> list[str]:
    found: dict[str, str] = {}
    frame, variant = picture_of(record)
    with suppress(InputError):
        found = recorded_files(read_record(store.folder, record), variant, frame)
    if not found:
        raise InputError(
            "is not a picture's record, and is not removed",
            where=store.root / record,
            do="inspect it, and remove it",
        )
    return list(found.values())

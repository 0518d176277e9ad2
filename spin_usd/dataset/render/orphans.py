"""Find and remove pictures that a dataset holds and its stage does not: another stage's, or of a frame it had once."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from spin_usd.dataset.plan.make_plan import Plan
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.dataset.store.tree import remove_emptied, remove_file
from spin_usd.dataset.store.unfinished import recorded_files
from spin_usd.errors import InputError

SHOWN = 3


def orphaned_pictures(store: Store, plan: Plan) -> list[Path]:
    """Return the records of pictures that are in the dataset and not in the stage, whatever part of that is wanted."""
    names, variants = set(plan.names), set(plan.known_variants)
    return [path for path in store.records() if path.stem not in names or path.parent.name not in variants]


def refuse(store: Store, orphans: Sequence[Path]) -> None:
    """Raise InputError where there are any."""
    if orphans:
        do = "choose another folder, or add --prune, which removes them"
        raise InputError(in_words(orphans), where=store.root, do=do)


def in_words(orphans: Sequence[Path]) -> str:
    """Say which pictures the dataset holds that are these records'."""
    names = ", ".join(f"{record.parent.name}/{record.stem}" for record in orphans[:SHOWN])
    count = "1 picture" if len(orphans) == 1 else f"{len(orphans)} pictures"
    return f"holds {count} that this stage does not have ({names}{', ...' if len(orphans) > SHOWN else ''})"


def remove(store: Store, orphans: Sequence[Path]) -> None:
    """Remove the pictures of these records: each one's record first, so that none ever describes files that are gone,
    then the files that it lists, and the folders left empty. Raises InputError where one is not a record, having
    removed nothing, and OutputError."""
    pictures = [(store.relative(record), *_files_of(store, record)) for record in orphans]
    for names in pictures:
        for name in names:
            remove_file(store.root, name)
        for name in names:
            remove_emptied(store.root, name)


def _files_of(store: Store, record: Path) -> list[str]:
    found: dict[str, str] = {}
    with suppress(InputError):
        found = recorded_files(read_json(record, "record-1"), record.parent.name, record.stem)
    if not found:
        raise InputError(
            "is not a picture's record, and is not removed", where=record, do="look what it is, and remove it"
        )
    return list(found.values())

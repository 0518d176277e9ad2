"""Records that break their schema, as the cause of an export that fails."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.errors import SpinError


@contextmanager
def blaming_records(dataset: Path) -> Iterator[None]:
    """Raise InputError that names the first record that breaks its schema, where the block fails over anything.

    To hold every record to its schema takes longer than to export it, so it is done when something has gone wrong.
    """
    try:
        yield
    except SpinError:
        raise
    except Exception:
        store = Store(root=dataset)
        for name in store.records():
            read_json(store.folder, name, "record-1")
        raise

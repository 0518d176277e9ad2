"""Findings on a dataset's cache. All are warnings: pictures do not need it, and renders fix it."""

from collections.abc import Iterator

from spin_usd.dataset.check.inventory import Inventory
from spin_usd.dataset.store.cache import CACHED, MEASURED, SHARDS, CacheEntry, entries
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.names import CACHE
from spin_usd.dataset.store.tree import files
from spin_usd.scene.finding import WARNING, Finding


def cache_findings(store: Store, inventory: Inventory) -> Iterator[Finding]:
    """Yield a finding on each file of the cache that is damaged, that no picture uses, or that is not the cache's."""
    known = {entry.path: entry for entry in entries(store)}
    for name in files(store.root, CACHE):
        path = store.root / name
        message = _wrong(known[path], inventory) if path in known else _foreign(name)
        if message:
            yield Finding(code="cache", where=name, message=message, severity=WARNING)


def _wrong(entry: CacheEntry, inventory: Inventory) -> str | None:
    used, file = entry.purpose in inventory.uses, entry.path.stat()
    if (file.st_dev, file.st_ino) not in inventory.inodes and not entry.whole:  # a label's file was verified already
        return "is damaged; when it is needed it will be made again" if used else "is damaged, and no picture uses it"
    return None if used else "no picture uses it; a render that makes a picture and leaves none out removes it"


def _foreign(name: str) -> str | None:
    parts = name.split("/")
    if len(parts) == 2 and parts[1] in (MEASURED, SHARDS):
        return None
    return f"is not of the cache; it holds {', '.join(CACHED)}"

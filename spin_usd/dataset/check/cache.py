"""Findings on a dataset's cache. All are warnings: pictures do not need it, and renders fix it."""

from collections.abc import Iterator, Set

from spin_usd.dataset.check.digests import MAKE_AGAIN
from spin_usd.dataset.check.inventory import Inventory
from spin_usd.dataset.store.cache import CACHED, MEASURED, CacheEntry, Purpose, entries
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.names import CACHE
from spin_usd.scene.finding import WARNING, Finding


def cache_findings(store: Store, inventory: Inventory) -> Iterator[Finding]:
    """Yield a finding on each file of the cache that is damaged, that no picture uses, or that is not the cache's."""
    known = {entry.file.name: entry for entry in entries(store)}
    in_use = inventory.uses if not inventory.unread else {entry.purpose for entry in known.values()}  # nobody knows
    for name in store.folder.files(CACHE):
        message = _wrong(known[name], inventory, in_use) if name in known else _foreign(name)
        if message:
            yield Finding(code="cache", where=name, message=message, severity=WARNING)


def _wrong(entry: CacheEntry, inventory: Inventory, in_use: Set[Purpose]) -> str | None:
    used, inode = entry.purpose in in_use, entry.file.folder.inode(entry.file.name)
    if inode not in inventory.inodes and not entry.whole:  # a label's file was verified already
        return f"is damaged; {MAKE_AGAIN}" if used else "is damaged, and no picture uses it; remove it"
    return None if used else "no picture uses it; the next full render that makes a picture removes it"


def _foreign(name: str) -> str | None:
    if name == MEASURED:
        return None
    return f"is not of the cache; it holds {', '.join(CACHED)}"

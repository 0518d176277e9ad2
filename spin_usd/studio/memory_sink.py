"""Pictures in memory: arrays of the last one, and renders kept for those after it."""

from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.records.record import RecordedFile
from spin_usd.scene.channels import Channels
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.store.cache import CacheEntry
from spin_usd.studio.recently_used import RecentlyUsed

KEPT_RENDERS = 1 << 26  # bytes: one render serves pictures in other strengths of light


class MemorySink:
    """Takes the arrays of a picture."""

    def __init__(self) -> None:
        self.arrays: dict[str, NDArray[Any]] = {}
        self.digests = True
        self._renders = RecentlyUsed[Radiance](KEPT_RENDERS)

    def begin(self, *, digests: bool) -> None:
        """Begin another picture; `digests`: whether entries of the record contain them."""
        self.arrays, self.digests = {}, digests

    def found_label(self, kind: str, key: str) -> CacheEntry | None:
        """Find no label: none is stored."""
        return None

    def found_render(self, key: str, scene: Scene, *, groups: int) -> Radiance | None:
        """Return a stored render."""
        return self._renders.find(key)

    def keep_render(self, key: str, rendered: Radiance) -> None:
        """Store a render."""
        self._renders.keep(key, rendered.in_own_pages(), rendered.nbytes)

    def write(
        self, scene: Scene, kind: str, array: NDArray[Any], channels: Channels, *, key: str | None = None
    ) -> RecordedFile:
        """Take an array; its entry in the record has the digest of its bytes in memory, rows from the top."""
        self.arrays[kind] = array = np.ascontiguousarray(array)
        path = f"{kind}/{scene.frame.variant}/{scene.frame.name}"
        return RecordedFile(path=path, sha256=sha256(array).hexdigest() if self.digests else "", **channels.described)

    def link(self, scene: Scene, cached: CacheEntry) -> RecordedFile:
        raise AssertionError("no label is stored")

    def remove(self, file: RecordedFile) -> None:
        """Do nothing: the arrays of the next picture replace these."""

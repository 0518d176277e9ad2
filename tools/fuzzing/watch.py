"""Watch folders for whoever opens a file there, by Linux's inotify; sees nothing elsewhere."""

import contextlib
import ctypes
import os
import struct
import sys
from collections.abc import Sequence
from pathlib import Path

# linux/inotify.h
ACCESSED, CHANGED, OPENED, MADE, REMOVED, MOVED = 0x1, 0x2, 0x20, 0x100, 0x200, 0xC0
FOLDER = 0x40000000
EVENT = struct.Struct("iIII")
READ = 1 << 16
WORDS = {ACCESSED: "read", CHANGED: "changed", OPENED: "opened", MADE: "made", REMOVED: "deleted", MOVED: "moved"}


class Watch:
    """A watch over the files directly in some folders, from now until `end`."""

    def __init__(self, folders: Sequence[Path]) -> None:
        self._folders: dict[int, Path] = {}
        self._descriptor = -1
        if sys.platform == "linux":
            libc = ctypes.CDLL(None)
            self._descriptor = libc.inotify_init1(os.O_NONBLOCK)
            for folder in folders:
                number = libc.inotify_add_watch(self._descriptor, os.fsencode(folder), sum(WORDS))
                self._folders[number] = folder

    def end(self) -> list[str]:
        """What happened, each file and word once. Listing a folder is no reading of its files."""
        if self._descriptor < 0:
            return []
        heard = bytearray()
        with contextlib.suppress(BlockingIOError):
            while more := os.read(self._descriptor, READ):
                heard += more
        os.close(self._descriptor)
        self._descriptor = -1
        return sorted({said for said in self._events(bytes(heard)) if said})

    def _events(self, heard: bytes) -> list[str]:
        at, said = 0, []
        while at < len(heard):
            number, mask, _, length = EVENT.unpack_from(heard, at)
            name = heard[at + EVENT.size : at + EVENT.size + length].rstrip(b"\0").decode(errors="replace")
            at += EVENT.size + length
            word = next((word for bit, word in WORDS.items() if mask & bit), None)
            if word and number in self._folders and not mask & FOLDER:
                said.append(f"{word}: {self._folders[number].name}/{name}")
        return said

"""The store of a measurement's results so far, by content: renders with their costs, and figures."""

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

from msgspec import Struct, to_builtins

from spin_usd.basics.nesting import typed_json
from spin_usd.errors import InputError
from spin_usd.files.changes import remove_emptied, remove_file
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.geometry.region import Region
from spin_usd.picture.render_file import RENDER_SUFFIX, encoded_render, read_render
from spin_usd.scene.passes import Radiance
from spin_usd.store.atomic import write_atomically, write_json

SUBJECT = "subject"  # the key of their subject
SUFFIXES = (".json", RENDER_SUFFIX)
NAME = re.compile(rf"([0-9a-f]{{2}})/(?=\1)[0-9a-f]{{64}}({'|'.join(map(re.escape, SUFFIXES))})")


def is_render_file(name: str) -> bool:
    """Return whether a file of that name, relative to the folder, is one of the store's."""
    return bool(NAME.fullmatch(name)) or name == render_file(SUBJECT)


def render_file(key: str, suffix: str = ".json") -> str:
    """Return the name, relative to the folder, of the file of that key."""
    return f"{key[:2]}/{key}{suffix}"


@dataclass(frozen=True, kw_only=True)
class RenderCost:
    """The cost of a render."""

    cpu_s: float
    """Seconds of one core."""
    wall_s: float
    """Seconds of wall clock."""
    memory_bytes: int
    """Largest number of bytes that its process held meanwhile."""
    warm: bool
    """Whether that process had rendered the same picture with the same effort just before."""


class KeptRender(Struct, frozen=True, kw_only=True):
    """The file beside a render."""

    cost: RenderCost
    sha256: str


@dataclass(frozen=True, kw_only=True)
class RenderStore:
    """The renders and results in the folder `root`; `work` is for temporary files.

    runs/<2>/<key>.exr    a render in unit light (picture.render_file)
    runs/<2>/<key>.json   its cost; or a result, such as a picture's figures

    <2> is the key's start. The JSON is written last, so that it marks complete results.
    """

    root: Path
    work: Path

    def has(self, key: str) -> bool:
        """Return whether the render of that key is there, every byte verified."""
        with suppress(InputError, OSError, ValueError):
            return self._folder.sha256(render_file(key, RENDER_SUFFIX)) == self._kept(key).sha256
        return False

    def cost(self, key: str) -> RenderCost:
        """Return the cost of an existing render."""
        return self._kept(key).cost

    def render(self, key: str, region: Region, *, groups: int) -> Radiance:
        """Read the render of that key. Raises InputError if it is missing or damaged."""
        file = FileIn(self._folder, render_file(key, RENDER_SUFFIX))
        found = read_render(file, region, groups=groups)
        if found is None:
            raise InputError("is damaged or replaced", where=file.path, do="run the measurement again")
        return found

    def keep(self, key: str, radiance: Radiance, cost: RenderCost) -> None:
        """Write a render and its cost. Raises OutputError."""
        encode = partial(encoded_render, radiance)
        sha256 = write_atomically(self._folder, render_file(key, RENDER_SUFFIX), encode, work=self.work)
        self.write_result(key, to_builtins(KeptRender(cost=cost, sha256=sha256)))

    def result(self, key: str) -> Path:
        """Return the file for the result of that key."""
        return self.root / render_file(key)

    def known(self, key: str) -> dict[str, Any] | None:
        """Return the result of that key; None if it is missing or damaged."""
        with suppress(InputError, ValueError):
            return typed_json(self._read(key), dict[str, Any])
        return None

    def write_result(self, key: str, value: Mapping[str, Any]) -> None:
        write_json(self._folder, render_file(key), value, work=self.work)

    def remove(self, keys: Iterable[str]) -> None:
        """Remove these renders and results."""
        for key in keys:
            for suffix in SUFFIXES:
                remove_file(self._folder, render_file(key, suffix))

    def remove_all(self, *, but: Iterable[str]) -> None:
        """Remove all but these, and the folders that become empty."""
        keep = set(but)
        for name in list(self._folder.files()):
            if is_render_file(name) and PurePosixPath(name).stem not in keep:
                remove_file(self._folder, name)
                remove_emptied(self._folder, name)

    def _kept(self, key: str) -> KeptRender:
        return typed_json(self._read(key), KeptRender)

    def _read(self, key: str) -> bytes:
        return self._folder.read(render_file(key), MAX_DOCUMENT)

    @property
    def _folder(self) -> Folder:
        return Folder(self.root)

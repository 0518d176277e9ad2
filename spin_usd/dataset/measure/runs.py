"""What a measurement has made so far, by content: renders with what they cost, and results.

runs/<2>/<key>.exr    a render in unit light (dataset.rendered)
runs/<2>/<key>.json   its cost; or a result, such as a picture's figures

<2> is the key's start. The JSON is written last, so that where it is all is.
"""

import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from spin_usd.dataset.rendered import RENDER_SUFFIX, read_render, write_render
from spin_usd.dataset.store import sha256_of, write_atomically, write_json
from spin_usd.errors import InputError
from spin_usd.geometry.region import Region
from spin_usd.scene.passes import Radiance


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Of a render: seconds of one core and of wall clock, the most bytes that its process held meanwhile, and whether
    that process had rendered the same picture with the same effort just before."""

    cpu_s: float
    wall_s: float
    memory_bytes: int
    warm: bool


@dataclass(frozen=True, kw_only=True)
class Runs:
    """Those in the folder `root`."""

    root: Path

    def has(self, key: str) -> bool:
        """Whether the render of that key is there, every byte verified."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            value = self._value(key)
            Cost(**value["cost"])
            return sha256_of(self._path(key, RENDER_SUFFIX)) == str(value["sha256"])
        return False

    def cost(self, key: str) -> Cost:
        """That of a render that is there."""
        return Cost(**self._value(key)["cost"])

    def render(self, key: str, region: Region, *, groups: int) -> Radiance:
        """The render of that key. Raises InputError where it is not there, or damaged."""
        path = self._path(key, RENDER_SUFFIX)
        found = read_render(path, region, groups=groups)
        if found is None:
            raise InputError("is not the render that was written", where=path, do="run the measurement again")
        return found

    def keep(self, key: str, radiance: Radiance, cost: Cost) -> None:
        """Write a render and its cost. Raises OutputError."""
        sha256 = write_atomically(self._path(key, RENDER_SUFFIX), partial(write_render, radiance=radiance))
        write_json(self._path(key, ".json"), {"cost": vars(cost), "sha256": sha256})

    def result(self, key: str) -> Path:
        """The file for the result of that key."""
        return self._path(key, ".json")

    def known(self, key: str) -> dict[str, Any] | None:
        """The result of that key; None where it is not there, or damaged."""
        with suppress(OSError, ValueError):
            return self._value(key)
        return None

    def write_result(self, key: str, value: Mapping[str, Any]) -> None:
        write_json(self._path(key, ".json"), value)

    def remove(self, keys: Iterable[str]) -> None:
        """Forget these renders and results."""
        for key in keys:
            self._path(key, ".json").unlink(missing_ok=True)
            self._path(key, RENDER_SUFFIX).unlink(missing_ok=True)

    def remove_all(self, *, but: Iterable[str]) -> None:
        """Forget all but these, and remove the folders that they leave empty."""
        keep = set(but)
        for path in sorted(self.root.glob("*/*")):
            if path.stem not in keep:
                path.unlink()
        for folder in self.root.glob("*"):
            with suppress(OSError):  # not empty
                folder.rmdir()

    def _value(self, key: str) -> dict[str, Any]:
        value: dict[str, Any] = json.loads(self._path(key, ".json").read_text(encoding="utf-8"))
        return value

    def _path(self, key: str, suffix: str) -> Path:
        return self.root / key[:2] / f"{key}{suffix}"

"""Variants whose pictures are the same, so that one of them is of no use."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.scene.scene import NOMINAL, FrameId, Scene, augmentation_and_camera
from spin_usd.stage.read.stage_reader import StageReader

# Any settings do: they are the same for all pictures that are compared.
SETTINGS = RenderSettings(renderer="", effort=Effort(), seed=0)
PROBES = 8  # pictures of a variant that are compared first


@dataclass(eq=False)
class IdenticalVariants:
    """Compares the variants of the stage at `path`, as its first camera sees them: by some pictures each, and by all
    where those are equal."""

    path: str | Path
    _probes: dict[str, dict[int, str]] = field(default_factory=dict)
    _keys: KeyMaker = field(default_factory=lambda: KeyMaker(SETTINGS))

    def add(self, scene: Scene, pictures: int) -> None:
        """Note one picture of the `pictures` of its variant, if it is a probe."""
        if scene.frame.index in _probes(pictures) and not augmentation_and_camera(scene.frame.variant)[1]:
            self._probes.setdefault(scene.frame.variant, {})[scene.frame.index] = _content(scene, self._keys)

    def findings(self, variant: str) -> Iterator[Finding]:
        """Compare a variant, all of whose pictures were added, to those before it."""
        for other, probes in self._probes.items():
            if other == variant or variant not in self._probes:
                return
            if probes == self._probes[variant] and self._equal(other, variant):
                message = f"the pictures of variant {variant} are those of {other}, apart from random noise; remove it"
                yield Finding(code="variant-same", where=str(self.path), message=message, severity=WARNING)
                return

    def _equal(self, a: str, b: str) -> bool:
        first = StageReader(self.path, variant=a)
        second = StageReader(self.path, variant=b, numbering=first.numbering)
        pairs = zip(*(_contents(reader, reader.frames) for reader in (first, second)), strict=True)
        return all(one == other for one, other in pairs)


@cache
def _probes(pictures: int) -> frozenset[int]:
    """Return the indices of the pictures to compare first: all, or PROBES that are spread evenly over them."""
    return frozenset(-(-probe * pictures // PROBES) for probe in range(PROBES)) & frozenset(range(pictures))


def _contents(reader: StageReader, frames: tuple[FrameId, ...]) -> Iterator[str]:
    keys = KeyMaker(SETTINGS)
    return (_content(reader.scene(frame), keys) for frame in frames)


def _content(scene: Scene, keys: KeyMaker) -> str:
    """Digest all that decides the picture, apart from its variant's seed."""
    return keys.keys(replace(scene, frame=replace(scene.frame, variant=NOMINAL))).exposure

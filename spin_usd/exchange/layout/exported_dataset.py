"""The dataset that is exported: which of its pictures, in which splits, under which names."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

from spin_usd.exchange.layout.exported_picture import ExportedPicture
from spin_usd.geometry.camera import Camera
from spin_usd.store.dataset import Dataset


class Entry(NamedTuple):
    """A picture of the export: frame and variant, its own name in the export, and what the format calls its split."""

    frame: str
    variant: str
    name: str
    split: str


@dataclass(frozen=True, kw_only=True, eq=False)
class ExportedDataset:
    """The pictures of a dataset that are exported, in order.

    dataset: all of it · entries: the pictures that are exported · splits: the names that the format gives them, also of
    those that are empty · target: the name of the target that formats of one target hold · cameras: of the pictures,
    each once · farthest: the greatest z of a target's origin, metres · options: the format's, by name.
    """

    dataset: Dataset
    entries: Sequence[Entry]
    splits: tuple[str, ...]
    target: str
    cameras: tuple[Camera, ...] = ()
    farthest: float = 0.0
    options: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.entries)

    def __iter__(self) -> Iterator[ExportedPicture]:
        """Yield the pictures, each read when its turn comes."""
        return (self.picture(number) for number in range(len(self.entries)))

    @cached_property
    def variants(self) -> tuple[str, ...]:
        """The variants of the pictures, each once, in order."""
        return tuple(dict.fromkeys(entry.variant for entry in self.entries))

    @property
    def camera(self) -> Camera:
        """The one camera of all pictures, where the format's limits say that there is but one."""
        return self.cameras[0]

    def picture(self, number: int) -> ExportedPicture:
        """Read the picture at that place."""
        entry = self.entries[number]
        return ExportedPicture(
            picture=self.dataset.picture(entry.frame, entry.variant),
            name=entry.name,
            number=number,
            split=entry.split,
            target_name=self.target,
        )

"""The dataset that is exported: which of its pictures, in which splits, under which names."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spin_usd.files.folder import FileIn, Folder
from spin_usd.geometry.camera import Camera
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.description import DescribedPart
from spin_usd.reading.picture import Picture
from spin_usd.reading.pictured_target import PicturedTarget

AMODAL = "mask_amodal"


@dataclass(frozen=True, kw_only=True, eq=False)
class ExportedPicture:
    """A picture of the dataset, and its place in the export.

    Formats take camera, image and labels from here, not from `picture`: these are the exported ones.
    """

    picture: Picture
    """As the dataset has it."""
    name: str
    """Unique in the export, and safe as a file's stem."""
    number: int
    """Its place in the export, from 0."""
    split: str
    """Name of the split in the format."""
    target_name: str
    """The target that formats of one target hold, where it is shown."""

    @property
    def variant(self) -> str:
        """The picture's variant."""
        return self.picture.variant

    @property
    def camera(self) -> Camera:
        """Size in pixels and lens; (0, 0) is the corner of the image."""
        return self.picture.camera

    @property
    def parts(self) -> Mapping[int, DescribedPart]:
        """The parts by their ids, which are the numbers in the segmentation."""
        return self.picture.parts

    @cached_property
    def targets(self) -> tuple[PicturedTarget, ...]:
        """All targets in order of their ids."""
        return self.picture.targets

    @property
    def target(self) -> PicturedTarget:
        """The target that formats of one target hold; the first that is shown where that is hidden."""
        return next((each for each in self.targets if each.name == self.target_name), self.targets[0])

    @property
    def image(self) -> NDArray[Any]:
        """The image, (H, W) or (H, W, 3), 8 or 16 bits."""
        return self.picture.image

    def label(self, kind: str) -> NDArray[Any]:
        """Return the label of that name, such as "depth". Raises InputError where the picture has none."""
        return self.picture.label(kind)

    def has(self, kind: str) -> bool:
        """Return whether the picture has a file of that kind."""
        return kind in self.picture.files

    @property
    def file_set(self) -> tuple[str, ...]:
        """The kinds of file that the picture has, with the endings of their names, such as "image.png"."""
        return tuple(f"{kind}{Path(file.path).suffix}" for kind, file in sorted(self.picture.files.items()))

    def file(self, kind: str) -> FileIn:
        """Return the dataset's file of that kind."""
        return FileIn(Folder(self.picture.root), self.picture.files[kind].path)

    def linkable(self, kind: str, suffix: str) -> bool:
        """Return whether the dataset's file of that kind is one with the ending `suffix`."""
        return self.picture.files[kind].path.endswith(suffix)

    def mask(self, target: int | None = None) -> NDArray[np.bool_]:
        """Return (H, W): the pixels in which the target with that id, or else `target`, is visible."""
        return self.picture.mask(self.target.id if target is None else target)

    def amodal_mask(self, target: int) -> NDArray[np.bool_]:
        """Return (H, W): the silhouette of the target with that id without occlusion. Without the label "mask_amodal"
        it is the visible part, which is the same for a single body."""
        if not self.has(AMODAL):
            return self.mask(target)
        return np.asarray(self.label(AMODAL) >> np.uint16(target - 1) & 1 > 0)


class Entry(NamedTuple):
    """A picture of the export: frame and variant, its name in the export, and the format's name for its split."""

    frame: str
    variant: str
    name: str
    split: str


@dataclass(frozen=True, kw_only=True, eq=False)
class ExportedDataset:
    """The pictures of a dataset that are exported, in order."""

    dataset: Dataset
    """All of it."""
    entries: Sequence[Entry]
    """The pictures that are exported."""
    splits: tuple[str, ...]
    """The format's names of the splits, also of empty ones."""
    target: str
    """The name of the target that formats of one target hold."""
    cameras: tuple[Camera, ...] = ()
    """Cameras of the pictures, each once."""
    farthest: float = 0.0
    """The greatest z of a target's origin, metres."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """The format's, by name."""

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
        """The camera of all pictures, for formats limited to one."""
        return self.cameras[0]

    def first(self, variant: str) -> ExportedPicture:
        """Read the first picture of the variant."""
        return self.picture(self.firsts[variant])

    @cached_property
    def firsts(self) -> dict[str, int]:
        """The place of each variant's first picture."""
        return {entry.variant: number for number, entry in reversed(list(enumerate(self.entries)))}

    def ended_by(self, picture: ExportedPicture) -> list[int]:
        """Return the places of all pictures of the variant that the picture is the last of; none if another follows."""
        following = self.entries[picture.number + 1 : picture.number + 2]
        if following and following[0].variant == picture.variant:
            return []
        return [number for number, entry in enumerate(self.entries) if entry.variant == picture.variant]

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

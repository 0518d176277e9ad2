"""A dataset as those who train and test with it read it."""

from collections.abc import Sequence
from functools import cached_property
from operator import index
from pathlib import Path
from typing import SupportsIndex, overload

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.url import refuse_unless_path
from spin_usd.scene.keypoints import Keypoints
from spin_usd.store.description import DescribedPart, DescribedTarget, Targets, read_description
from spin_usd.store.names import RECORDS, is_record, picture_of, record_of
from spin_usd.store.picture import Picture, read_picture

NAMED = 3  # names that an error lists as examples


class Dataset(Sequence[Picture]):
    """The pictures in a dataset's folder, ordered by variant and by frame.

    `dataset[0]` is a Picture, `dataset[:100]` a Dataset of the first hundred, and a loop over a dataset goes through
    its pictures. Each is read when it is asked for: a Dataset holds no more than their names, so it is quick to open,
    to pickle and to send to other processes. PyTorch's DataLoader takes it as a map-style dataset; its `collate_fn`
    gets a list of pictures, in the worker's process, and makes a batch of them.

    Pictures that are rendered after a dataset was opened are not in it.
    """

    def __init__(self, path: str | Path) -> None:
        """Open the dataset in the folder `path`. Raises InputError where there is none."""
        refuse_unless_path(path, "path")
        self._root = Path(path).absolute()
        self._description = read_description(self._root)
        self._names = _names(self._root)

    def __len__(self) -> int:
        return len(self._names)

    @overload
    def __getitem__(self, place: SupportsIndex) -> Picture: ...
    @overload
    def __getitem__(self, place: slice) -> "Dataset": ...
    def __getitem__(self, place: SupportsIndex | slice) -> "Picture | Dataset":
        if isinstance(place, slice):
            return self._of(self._names[place])
        try:
            return self._read(self._names[index(place)])
        except IndexError:
            raise IndexError(f"there is no picture {place}; {self.root} has {len(self)}") from None

    def __repr__(self) -> str:
        count = f"{len(self)} picture{'s' * (len(self) != 1)}"
        return f"Dataset({str(self.root)!r}, {count}, variants: {', '.join(self.variants) or 'none'})"

    @property
    def root(self) -> Path:
        """The dataset's folder, an absolute path."""
        return self._root

    @property
    def names(self) -> tuple[tuple[str, str], ...]:
        """(frame, variant) of each picture, in order."""
        return self._names

    @property
    def variants(self) -> tuple[str, ...]:
        """The variants that the pictures are of, each once, in order."""
        return tuple(dict.fromkeys(variant for _, variant in self._names))

    @property
    def targets(self) -> Targets[DescribedTarget]:
        """The targets in order of their ids, which are the numbers in the label `instance`."""
        return self._description.targets

    @property
    def target(self) -> str:
        """The first target's name."""
        return self._description.targets[0].name

    @property
    def parts(self) -> dict[int, DescribedPart]:
        """The bodies' parts by their ids, which are the numbers in the segmentation."""
        return dict(self._description.parts)

    @property
    def keypoints(self) -> Keypoints:
        """The first target's named points: names, and points (N, 3) float64 in the body's axes, metres."""
        return self._description.targets[0].keypoints

    def picture(self, frame: str, variant: str = "nominal") -> Picture:
        """Return the picture of that frame and variant. Raises InputError where there is none."""
        self.require(frame, variant)
        return self._read((frame, variant))

    def require(self, frame: str, variant: str = "nominal") -> None:
        """Raise InputError, with names that there are, unless the picture of that frame and variant is there."""
        if (frame, variant) not in self._known:
            raise InputError(
                f"has no picture {frame!r} in variant {variant!r}", where=self.root, do=self._examples(variant)
            )

    def of_variant(self, variant: str) -> "Dataset":
        """Return the pictures of one variant. Raises InputError where there are none."""
        names = tuple(name for name in self._names if name[1] == variant)
        if not names:
            raise InputError(f"has no picture of variant {variant!r}", where=self.root, do=self._examples(variant))
        return self._of(names)

    def _read(self, name: tuple[str, str]) -> Picture:
        frame, variant = name
        return read_picture(self.root, record_of(variant, frame), self._description)

    def _of(self, names: tuple[tuple[str, str], ...]) -> "Dataset":
        """Return the same dataset with these pictures alone."""
        part = Dataset.__new__(Dataset)
        part._root, part._description, part._names = self._root, self._description, names
        return part

    @cached_property
    def _known(self) -> frozenset[tuple[str, str]]:
        return frozenset(self._names)

    def _examples(self, variant: str) -> str:
        """Return the names there are, for an error about one that is not."""
        frames = [frame for frame, other in self._names if other == variant][:NAMED]
        if frames:
            return f"pictures are named like {', '.join(frames)}"
        return f"choose among the variants {', '.join(self.variants)}" if self._names else "render it first"


def _names(root: Path) -> tuple[tuple[str, str], ...]:
    """List (frame, variant) of each picture in the folder `root`, from the names of the records' files alone."""
    return tuple(map(picture_of, filter(is_record, Folder(root).files(RECORDS))))

"""A dataset as those who train and test with it read it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from numbers import Real
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self, SupportsIndex, TypeAlias, overload

import numpy as np

from spin_usd.basics.pluralise import pluralise
from spin_usd.errors import InputError, MissingPackageError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.url import refuse_unless_path
from spin_usd.reading.description import DescribedPart, DescribedTarget, Targets, read_description
from spin_usd.reading.events import EventStream
from spin_usd.reading.measures import values_of
from spin_usd.reading.picture import Picture, read_picture
from spin_usd.reading.splits import pose_bytes, poses_of, split_of_each
from spin_usd.reading.window import margin_of, size_of
from spin_usd.scene.keypoints import Keypoints
from spin_usd.store.names import EVENTS, RECORDS, events_of, is_record, picture_of, record_of

if TYPE_CHECKING:
    from pandas import DataFrame

NAMED = 3  # names that an error lists as examples
TYPES = ("bool", "uint8", "int16", "int32", "int64", "float16", "float32", "float64")  # that PyTorch has


@dataclass(frozen=True, kw_only=True)
class Cropped:
    """How each picture is cropped: see Picture.crop."""

    target: int
    size: tuple[int, int]
    margin: float

    def __call__(self, picture: Picture) -> Picture:
        return picture.crop(self.target, self.size, margin=self.margin)


@dataclass(frozen=True, kw_only=True)
class Resized:
    """How each picture is resized: see Picture.resize."""

    size: tuple[int, int]

    def __call__(self, picture: Picture) -> Picture:
        return picture.resize(self.size)


@dataclass(frozen=True, kw_only=True)
class Labelled:
    """Which of its files each picture has: see Picture.only."""

    labels: tuple[str, ...]

    def __call__(self, picture: Picture) -> Picture:
        return picture.only(self.labels)


Change: TypeAlias = Cropped | Resized | Labelled


class Dataset(Sequence[Picture]):
    """The pictures in a dataset's folder, ordered by variant and by frame.

    `dataset[0]` is a Picture, `dataset[:100]` a Dataset of the first hundred, and a loop over a dataset goes through
    its pictures. Each is read on access: a Dataset only holds their names, so it is quick to open, to pickle and to
    send to other processes. PyTorch's DataLoader takes it as a map-style dataset, and its `collate` as `collate_fn`,
    which gets a list of pictures, in the worker's process, and makes a batch of them.

    Pictures that are rendered after a dataset was opened are not in it.
    """

    def __init__(self, path: str | Path, *, labels: str | Sequence[str] | None = None) -> None:
        """Open the dataset in the folder `path`. labels: "image", "depth" and so on; other files of a picture are
        neither read nor stacked by `collate`; all if not given. Raises InputError if there is no dataset, or its first
        picture lacks one of them."""
        refuse_unless_path(path, "path")
        self._root = Path(path).absolute()
        self._description = read_description(self._root)
        self._names = _names(self._root)
        self._changes: tuple[Change, ...] = ()
        if labels is not None:
            wanted = (labels,) if isinstance(labels, str) else tuple(dict.fromkeys(labels))
            there = list(self[0].files) if self._names else wanted
            if lacking := next((label for label in wanted if label not in there), None):
                do = f"choose among {', '.join(there)}, or render it too"
                raise InputError(f"has no label {lacking!r}", where=self.root, do=do)
            self._changes = (Labelled(labels=wanted),)

    def __len__(self) -> int:
        return len(self._names)

    @overload
    def __getitem__(self, place: SupportsIndex) -> Picture: ...
    @overload
    def __getitem__(self, place: slice) -> Self: ...
    def __getitem__(self, place: SupportsIndex | slice) -> Picture | Self:
        try:
            if isinstance(place, slice):
                return self._of(self._names[place])
            found = self._names[place]
        except IndexError:
            raise IndexError(f"there is no picture {place}; {self.root} has {len(self)}") from None
        except TypeError:
            do = "give its place, from 0, or its names as in dataset.picture(FRAME, VARIANT)"
            raise InputError(f"there is no picture {place!r}", where=self.root, do=do) from None
        return self._read(found)

    def __repr__(self) -> str:
        count = f"{len(self)} picture{'s' * (len(self) != 1)}"
        return f"{type(self).__name__}({str(self.root)!r}, {count}, variants: {', '.join(self.variants) or 'none'})"

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
        """Return the picture of that frame and variant. Raises InputError if there is none."""
        self.require(frame, variant)
        return self._read((frame, variant))

    def require(self, frame: str, variant: str = "nominal") -> None:
        """Raise InputError, with existing names, unless the picture of that frame and variant exists."""
        if (frame, variant) not in self._known:
            raise InputError(
                f"has no picture {frame!r} in variant {variant!r}", where=self.root, do=self._examples(variant)
            )

    def of_variant(self, variant: str) -> Self:
        """Return the pictures of one variant. Raises InputError if there are none."""
        names = tuple(name for name in self._names if name[1] == variant)
        if not names:
            raise InputError(f"has no picture of variant {variant!r}", where=self.root, do=self._examples(variant))
        return self._of(names)

    def events(self, variant: str | None = None) -> EventStream:
        """Return the events of that variant; the name is optional if only one has events. Raises InputError if there
        are none, or several and none is named."""
        folder = Folder(self.root)
        known = [PurePosixPath(name).stem for name in folder.files(EVENTS) if name.endswith(".h5")]
        if not known:
            raise InputError("has no events", where=self.root, do="render it with --events")
        if variant is None and len(known) > 1:
            raise InputError("has events of several variants", where=self.root, do=f"choose among {', '.join(known)}")
        if variant is not None and variant not in known:
            do = f"choose among {', '.join(known)}"
            raise InputError(f"has no events of variant {variant!r}", where=self.root, do=do)
        return EventStream(FileIn(folder, events_of(variant or known[0])))

    def where(self, condition: str | Callable[[Picture], bool]) -> Self:
        """Return the pictures that meet the condition: a function of a Picture, or a text such as
        "range < 8 and visible > 0.5 and variant != 'nominal'".

        A text uses the columns of `to_dataframe`, any value of a record such as `record.sun.obscured`, and NAME.range
        for a further target. Missing values are NaN: no comparison holds for them. Every record is read, some 4,000 a
        second. Raises InputError for an invalid condition.
        """
        from spin_usd.reading.condition import EXAMPLE, Condition  # not above: a dataset opens without it

        if not (isinstance(condition, str) or callable(condition)):
            raise InputError(f"{condition!r} is not a condition", do=f"{EXAMPLE}, or give a function of a Picture")
        meets = Condition(condition, self._description) if isinstance(condition, str) else condition
        names = tuple(name for name, picture in zip(self._names, self, strict=True) if meets(picture))
        if isinstance(meets, Condition) and self._names:
            meets.refuse_never_found()
        return self._of(names)

    def split(self, *shares: float, seed: int = 0, by: str = "pose") -> tuple[Self, ...]:
        """Return a dataset for each of the shares, which sum up to 1 or less: `train, test = dataset.split(0.8, 0.2)`.

        by: "pose" keeps pictures of one pose, such as all variants of a frame, together; "picture" splits them freely.
        The split depends only on names and the seed, as in `export --split`: it is the same on every machine. Raises
        InputError for invalid shares, and for a share of less than half a pose.
        """
        numbers = all(isinstance(share, Real) and isfinite(share) and share > 0 for share in shares)
        if not shares or not numbers or sum(shares) > 1 + 1e-9:
            raise InputError(f"the shares {shares} are invalid", do="give numbers above 0 that sum to 1, as 0.8, 0.2")
        if by not in ("pose", "picture"):
            raise InputError(f"pictures cannot be split by {by!r}", do="choose among pose, picture")
        named = {str(number): share for number, share in enumerate(shares)}
        if by == "pose":
            pose = poses_of((picture.frame, pose_bytes(picture)) for picture in self._whole)
            group = {name: pose[name[0]] for name in self._names}
        else:
            group = {name: f"{name[0]}-{name[1]}" for name in self._names}
        split = split_of_each(list(group.values()), named, seed=seed)
        parts = tuple(
            self._of(tuple(name for name in self._names if split.get(group[name]) == number)) for number in named
        )
        for share, part in zip(shares, parts, strict=True):
            if not part:
                found = f"{share:g} of {pluralise(len(set(group.values())), by)} is less than one"
                raise InputError(found, where=self.root, do="give larger shares, or split more pictures")
        return parts

    def crop(self, target: int | str | None = None, size: int | tuple[int, int] = 256, *, margin: float = 0.1) -> Self:
        """Return the same pictures, each cropped to the target as Picture.crop does when it is read. A picture that
        shows nothing of the target is an InputError then: leave such out by `where("visible > 0")`. Raises InputError
        for a target, a size or a margin that cannot be."""
        found = self._description.target(1 if target is None else target).id
        return self._of(self._names, Cropped(target=found, size=size_of(size), margin=margin_of(margin)))

    def resize(self, size: int | tuple[int, int]) -> Self:
        """Return the same pictures, each in that size as by Picture.resize when it is read. Raises InputError for a
        size that cannot be."""
        return self._of(self._names, Resized(size=size_of(size)))

    @staticmethod
    def collate(
        pictures: Sequence[Picture],
        labels: str | Sequence[str] | None = None,
        types: Mapping[str, str] = MappingProxyType({}),
    ) -> dict[str, Any]:
        """Return a batch of B pictures of one size, for PyTorch's DataLoader as its `collate_fn`.

        labels: names of the files to stack: "image" (B, H, W) or (B, H, W, 3), "depth" and so on; if not given, the
        labels of the dataset, else the image. Another choice is `functools.partial(Dataset.collate, labels=("image",
        "depth"))`. types: other types of arrays by their names, such as {"segmentation": "int64", "T_cam_body":
        "float32"}. Besides the labels it has "camera_matrix" (B, 3, 3), and of the first target "T_cam_body" (B, 4, 4),
        "q_cam_body" (B, 4), "t_cam_body" (B, 3), "box_visible" (B, 4), "keypoints" (B, K, 2) pixels and
        "keypoints_visible" (B, K); and the lists "frame" and "variant". Arrays are numpy's: `torch.from_numpy` takes
        them without a copy. Raises InputError for pictures of several sizes, or none.
        """
        if not pictures:
            raise InputError("there is no picture to make a batch of", do="give one or more")
        first = [picture.targets[0] for picture in pictures]
        own = ("image",) if pictures[0].labels is None else pictures[0].labels
        wanted = own if labels is None else [labels] if isinstance(labels, str) else labels
        stacked = {label: [np.asarray(picture.label(label)) for picture in pictures] for label in wanted}
        for label, arrays in stacked.items():
            shapes = sorted({array.shape for array in arrays})
            if len(shapes) > 1:
                found, do = f"cannot be stacked: {label} is {shapes[0]} and {shapes[1]}", "try dataset.resize(256)"
                raise InputError(found, where=pictures[0].root, do=do)
        batch: dict[str, Any] = {
            **{label: np.stack(arrays) for label, arrays in stacked.items()},
            "camera_matrix": np.stack([picture.camera_matrix for picture in pictures]),
            "T_cam_body": np.stack([picture.T_cam_body for picture in pictures]),
            "q_cam_body": np.stack([picture.q_cam_body for picture in pictures]),
            "t_cam_body": np.stack([picture.t_cam_body for picture in pictures]),
            "box_visible": np.stack([target.box_visible for target in first]),
            "keypoints": np.stack([target.keypoints for target in first]),
            "keypoints_visible": np.array([target.keypoint_states for target in first]) == "visible",
            "frame": [picture.frame for picture in pictures],
            "variant": [picture.variant for picture in pictures],
        }
        for name, type in types.items():
            if not isinstance(batch.get(name), np.ndarray):
                there = ", ".join(each for each, array in batch.items() if isinstance(array, np.ndarray))
                raise InputError(f"a batch has no array {name!r} to be {type}", do=f"choose among {there}")
            if type not in TYPES:
                raise InputError(f"{name} cannot be of the type {type!r}", do=f"choose among {', '.join(TYPES)}")
            batch[name] = batch[name].astype(type)
        return batch

    def to_dataframe(self) -> "DataFrame":
        """Return a table of pandas with a row for each picture: frame, variant, index, the files' paths, the first
        target's pose and the values of `where` by the same names; values of further targets are called NAME.range and
        so on. Raises MissingPackageError without pandas."""
        try:
            from pandas import DataFrame
        except ImportError:
            raise MissingPackageError("pandas is not installed", do="run pip install pandas") from None
        return DataFrame([values_of(picture) for picture in self])

    @property
    def _whole(self) -> Iterator[Picture]:
        """The pictures as they were rendered."""
        return map(self._stored, self._names)

    def _read(self, name: tuple[str, str]) -> Picture:
        picture = self._stored(name)
        for change in self._changes:
            picture = change(picture)
        return picture

    def _stored(self, name: tuple[str, str]) -> Picture:
        """Read a picture as it was rendered."""
        frame, variant = name
        return read_picture(self.root, record_of(variant, frame), self._description)

    def _of(self, names: tuple[tuple[str, str], ...], *changes: Change) -> Self:
        """Return the same dataset with these pictures alone, changed in these ways too."""
        part = copy(self)
        part.__dict__.pop("_known", None)
        part._names, part._changes = names, (*self._changes, *changes)
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

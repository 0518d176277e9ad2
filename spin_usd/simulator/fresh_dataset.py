"""A dataset whose pictures look new each time: developed from its renders in strengths of light, cameras and noise that
are drawn by a specification."""

import os
import weakref
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Self, SupportsIndex, overload

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from spin_usd.basics.extras import EXTRAS
from spin_usd.basics.faults import reading
from spin_usd.errors import InputError
from spin_usd.files.url import refuse_unless_path
from spin_usd.picture.kinds import IMAGE
from spin_usd.processes.deaths import READING_TRIES
from spin_usd.processes.held_folder import nameless_file, nameless_file_of
from spin_usd.reading.dataset import Change, Dataset
from spin_usd.reading.picture import Picture
from spin_usd.simulator.array_workers import ArrayTask, ArrayWorkers
from spin_usd.simulator.calls import DEVELOP_IMAGE, OPEN_FRESH, DevelopedImage, DevelopImage, OpenFresh
from spin_usd.specifications.augmentation_spec import read_augmentation_spec, spec_path
from spin_usd.studio.picture_request import whole_number

EPOCH_BYTES, TOKEN_BYTES = 8, 16
MOST_EPOCHS = 1 << 63


class SharedEpoch:
    """An epoch that this process shares with its copies in other processes: workers of a loader may outlive it."""

    def __init__(self, epoch: int) -> None:
        self._begin(epoch)

    def _begin(self, epoch: int) -> None:
        self._hold(nameless_file())
        os.pwrite(self._file, os.urandom(TOKEN_BYTES), EPOCH_BYTES)
        self.number = epoch

    @property
    def number(self) -> int:
        """The epoch."""
        return int.from_bytes(os.pread(self._file, EPOCH_BYTES, 0), "little")

    @number.setter
    def number(self, epoch: int) -> None:
        os.pwrite(self._file, epoch.to_bytes(EPOCH_BYTES, "little"), 0)

    def __getstate__(self) -> tuple[int, int, bytes]:
        return os.getpid(), self._file, os.pread(self._file, EPOCH_BYTES + TOKEN_BYTES, 0)

    def __setstate__(self, state: tuple[int, int, bytes]) -> None:
        """Open the memory of the sender if it still has it; else, and in the sender itself, have its epoch alone."""
        process, file, content = state
        if process != os.getpid():
            with suppress(OSError):
                self._hold(nameless_file_of(process, file))
                if os.pread(self._file, TOKEN_BYTES, EPOCH_BYTES) == content[EPOCH_BYTES:]:
                    return
        self._begin(int.from_bytes(content[:EPOCH_BYTES], "little"))

    def _hold(self, file: int) -> None:
        self._file = file
        weakref.finalize(self, os.close, file)


class FreshChild:
    """The process that develops images, one for each process that reads the dataset; the first request starts it."""

    def __init__(self, dataset: Path, spec: Path, seed: int) -> None:
        self._of = str(dataset), str(spec), seed
        self._process = 0
        self._arrays: ArrayWorkers[None] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {"_of": self._of, "_process": 0, "_arrays": None}

    def image(self, request: DevelopImage) -> tuple[NDArray[Any], DevelopedImage]:
        """Return the requested image, and the values drawn for it. Raises the errors of the child."""
        if self._arrays is None or self._process != os.getpid():
            self._arrays, self._process = ArrayWorkers(OPEN_FRESH, self._opening), os.getpid()
        task = ArrayTask(call=DEVELOP_IMAGE, request=request, tries=READING_TRIES)
        developed = self._arrays.result(self._arrays.submit(task))
        return task.arrays[IMAGE], developed

    def _opening(self, number: int, memory: int) -> OpenFresh:
        dataset, spec, seed = self._of
        return OpenFresh(dataset=dataset, spec=spec, seed=seed, memory=memory)


@dataclass(frozen=True, kw_only=True, eq=False)
class FreshPicture(Picture):
    """A stored picture whose image is developed anew. Labels and record are the stored ones; the record's light and
    exposure describe the stored image.

    Attributes:
        child: the process that develops it.
        epoch: number that its appearance is drawn with.
    """

    child: FreshChild
    epoch: int

    @cached_property
    def drawn(self) -> DevelopedImage:
        """The drawn values: `augmentation`, its name in the specification; `values` by parameter, in their units."""
        _ = self.image  # which sets them
        found: DevelopedImage = self.__dict__["drawn"]
        return found

    def __repr__(self) -> str:
        return f"FreshPicture({self.frame!r} of {self.variant!r}, in {str(self.root)!r}, epoch {self.epoch})"

    def _array(self, kind: str, rows: range | None = None) -> NDArray[Any]:
        if kind != IMAGE:
            return super()._array(kind, rows)
        request = DevelopImage(frame=self.frame, variant=self.variant, epoch=self.epoch)
        if self.window is None:
            whole, self.__dict__["drawn"] = self.child.image(request)
            return whole if rows is None else whole[rows.start : rows.stop : rows.step]
        camera = self._whole_camera
        down, across = self.window.rows(camera.height), self.window.columns(camera.width)
        region = across.start, down.start, across.stop, down.stop
        part, self.__dict__["drawn"] = self.child.image(structs.replace(request, region=region))
        lines = np.zeros((len(down), camera.width, *part.shape[2:]), part.dtype)
        lines[:, across.start : across.stop] = part
        found = self.window.cut(lines, down.start, smooth=True)
        return found if rows is None else found[rows.start : rows.stop : rows.step]


class FreshDataset(Dataset):
    """The pictures of a dataset, each with a new image: a specification of augmentations draws strengths and colours of
    lights, exposure, optics, the detector and its noise, and photographs behind for each picture and epoch, and the
    image is developed with them from the render in the dataset's cache. Labels are the stored ones, and exact.

    The same specification, seed, epoch and picture give the same image, in any process. It can replace a Dataset, also
    in PyTorch's DataLoader, however its workers start and whether or not they are persistent. Only the crop of a
    cropped picture is developed.
    """

    def __init__(
        self,
        path: str | Path | Dataset,
        spec: str | Path,
        *,
        seed: int = 0,
        epoch: int = 0,
        labels: str | Sequence[str] | None = None,
    ) -> None:
        """Open the dataset.

        Args:
            path: The dataset's folder, or a part of one, such as Dataset.split returns.
            spec: The specification's file, or its name. Each picture takes one of its augmentations.
            seed: Seed of all drawn values.
            epoch: A number; each draws other values.
            labels: As for Dataset.

        Raises:
            InputError: For a specification that cannot be read.
            MissingPackageError: Beside the extra [read] alone.
        """
        EXTRAS["render"].require("FreshDataset", but="bpy")
        with reading():
            file = spec_path(spec)
            read_augmentation_spec(file)
        if not isinstance(path, Dataset):
            refuse_unless_path(path, "path")
        root = path.root if isinstance(path, Dataset) else Path(path)
        self._epoch = SharedEpoch(_checked(epoch))
        self._child = FreshChild(root.absolute(), file.absolute(), whole_number(seed, "the seed"))
        super().__init__(root, labels=labels)
        if isinstance(path, Dataset):
            self._names, self._changes = path._names, (*path._changes, *self._changes)

    def set_epoch(self, epoch: int) -> None:
        """Draw the appearances of that epoch for all pictures read from now on, here and in the copies in other
        processes, such as a loader's workers. A slice, split or crop has an epoch of its own, this one's at first.
        Raises InputError unless it is a whole number from 0."""
        self._epoch.number = _checked(epoch)

    @overload
    def __getitem__(self, place: SupportsIndex) -> FreshPicture: ...
    @overload
    def __getitem__(self, place: slice) -> Self: ...
    def __getitem__(self, place: SupportsIndex | slice) -> FreshPicture | Self:
        found: FreshPicture | Self = super().__getitem__(place)  # type: ignore[assignment]
        return found

    def _read(self, name: tuple[str, str]) -> FreshPicture:
        stored = self._stored(name)
        picture = FreshPicture(
            **{field.name: getattr(stored, field.name) for field in fields(Picture)},
            child=self._child,
            epoch=self._epoch.number,
        )
        for change in self._changes:
            changed = change(picture)
            assert isinstance(changed, FreshPicture)
            picture = changed
        return picture

    def _of(self, names: tuple[tuple[str, str], ...], *changes: Change) -> Self:
        part = super()._of(names, *changes)
        part._epoch = SharedEpoch(self._epoch.number)
        return part


def _checked(epoch: int) -> int:
    number = whole_number(epoch, "the epoch")
    if not 0 <= number < MOST_EPOCHS:
        raise InputError(f"there is no epoch {number}", do="give 0 or more")
    return number

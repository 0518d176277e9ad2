"""Write the page of a dataset: its records first, then the files of each picture, then the index."""

import re
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd import __version__
from spin_usd.basics.progress import Progress
from spin_usd.commands.show.columns import Column, Columns
from spin_usd.commands.show.data_file import KEY_LENGTH, DataFile
from spin_usd.commands.show.gallery_folder import PAGE, GalleryFolder, refuse_other
from spin_usd.commands.show.options import ShowOptions
from spin_usd.commands.show.picture_keys import SHOW_PICTURE, PictureKeys, ShowPicture
from spin_usd.commands.show.read_records import ReadPicture, read_records
from spin_usd.errors import InputError, OutputError
from spin_usd.geometry.lens import invertible_radius
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.options import takes
from spin_usd.processes.child_ahead import next_child
from spin_usd.processes.deaths import READING_TRIES
from spin_usd.processes.executor import done_in_order
from spin_usd.processes.processors import usable_cpus
from spin_usd.processes.task import Task
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.measures import described
from spin_usd.reading.picture import Picture
from spin_usd.store.dataset_folder import Store, refuse_dataset
from spin_usd.store.tags import TAGS, read_tags

PER_FILE = 64  # half a megabyte of JSON, a tenth of it packed: they are much alike
PICTURES_PER_CHILD = 8  # starting one takes as long as so many
Header = dict[str, Any]
Arrays = dict[str, NDArray[Any]]
DIGEST = re.compile("[0-9a-f]{64}")


@dataclass(frozen=True, kw_only=True)
class GalleryReport:
    """The report of a gallery that was written."""

    page: str
    """The file to open in a browser."""
    pictures: int
    """How many it has."""
    made: int
    """How many pictures had files to write."""
    kept: int
    """How many pictures had all their files already."""
    damaged: dict[str, str]
    """Fault of each damaged picture, by VARIANT/FRAME."""
    bytes: int
    """Of all that the folder holds."""
    seconds: float
    """Wall-clock time."""


@takes(ShowOptions)
def show(options: ShowOptions) -> GalleryReport:
    """Write a page that shows a dataset in a browser, in its own folder. Another run adds what is missing.

    Damaged pictures do not raise errors; they are in the report's `damaged`.

    Raises InputError if there is no dataset, or the folder contains something else, and OutputError.
    """
    began, progress = time.monotonic(), options.progress
    dataset = _opened(Path(options.dataset))
    beside = _opened(Path(options.beside)) if options.beside else None
    tags = _tags_of(dataset)
    refuse_dataset(options.page_folder, Path(options.dataset))
    refuse_other(options.page_folder)
    with Store(root=options.page_folder).locked() as lease:
        folder = GalleryFolder(options.page_folder, lease.work)
        folder.describe(Path(options.dataset))
        pictures, header, arrays = _read_all(dataset, options, folder, progress)
        others: list[ReadPicture] = []
        if beside:
            others, of_beside, numbers = _read_beside(beside, pictures, options, folder, progress)
            header, arrays = header | {"beside": of_beside}, arrays | numbers
        missing = missing_files([*pictures, *others], folder.present)
        of_files = write_files([*pictures, *others], missing, options, lease.work, progress=progress)
        faults = {at: fault for at, picture in enumerate(pictures) if (fault := picture.faults(of_files))}
        header |= {"given": str(options.dataset), "faults": faults, "tags": tags}
        folder.write_page(DataFile(header, arrays))
        folder.remove_unused({name for picture in [*pictures, *others] for name in picture.keys.names.values()})
    made = sum(place < len(pictures) for place in missing)  # those beside follow
    return GalleryReport(
        page=str(options.page_folder / PAGE),
        pictures=len(pictures),
        made=made,
        kept=sum(not picture.fault for picture in pictures) - made,
        damaged={f"{pictures[at].variant}/{pictures[at].frame}": fault for at, fault in faults.items()},
        bytes=folder.total_bytes(),
        seconds=time.monotonic() - began,
    )


def _opened(path: Path) -> Dataset:
    dataset = Dataset(path)
    if not len(dataset):
        raise InputError("holds no picture", where=path, do="render some first")
    return dataset


def _tags_of(dataset: Dataset) -> Mapping[str, Sequence[str]]:
    file = dataset.root / TAGS
    return read_tags(file) if file.is_file() else {}


def _read_all(
    dataset: Dataset, request: ShowOptions, folder: GalleryFolder, progress: Progress
) -> tuple[list[ReadPicture], Header, Arrays]:
    """Read all records and write them and their columns; return the pictures, and the index known so far."""
    pictures, columns, shelf, kinds = [], Columns(), RecordFiles(folder), dict[str, None]()
    for picture in read_records(dataset, request, what="reading: record", progress=progress):
        columns.add(picture.values)
        shelf.add(picture)
        kinds |= dict.fromkeys(picture.keys.kinds)
        pictures.append(replace(picture, picture=None, values={}))
    shelf.finish()
    header, arrays = pictures_of(pictures)
    held = dict(columns.columns())
    measures, numbers = measures_of(dataset, held)
    others = {name: column for name, column in held.items() if name not in numbers}
    header |= described_dataset(dataset, list(kinds)) | {"records": shelf.files, "per_file": PER_FILE}
    header |= {"events": any(picture.keys.events for picture in pictures)}
    header |= {"measures": measures, "columns": list(columns_of(others, folder))}
    return pictures, header, arrays | numbers


def _read_beside(
    dataset: Dataset, own: Sequence[ReadPicture], request: ShowOptions, folder: GalleryFolder, progress: Progress
) -> tuple[list[ReadPicture], Header, Arrays]:
    """Read the records of the dataset to compare with, and write those of pictures with a name in our `own`; return
    these, the dataset's entry, its measures, and the index among these of the counterpart of each of our own, -1 for
    none."""
    columns, shelf, kinds = Columns(), RecordFiles(folder), dict[str, None]()
    row_of = {(picture.frame, picture.variant): row for row, picture in enumerate(own)}
    pictures: list[ReadPicture] = []
    place_of = np.full(len(own), -1, np.int32)
    for picture in read_records(dataset, request, what="reading: record beside", progress=progress):
        columns.add(picture.values)
        row = row_of.get((picture.frame, picture.variant))
        if row is not None and picture.picture:
            place_of[row] = len(pictures)
            shelf.add(picture)
            kinds |= dict.fromkeys(picture.keys.kinds)
            pictures.append(replace(picture, picture=None, values={}))
    shelf.finish()
    measures, arrays = measures_of(dataset, dict(columns.columns()), prefix="beside ")
    header = described_dataset(dataset, list(kinds)) | {"count": len(dataset), "measures": measures}
    return pictures, header | {"records": shelf.files}, arrays | {"place beside": place_of}


class RecordFiles:
    """Writes the records of pictures into the folder as they come. `files`: their names, PER_FILE pictures in each."""

    def __init__(self, folder: GalleryFolder) -> None:
        self.files: list[str] = []
        self._folder, self._held = folder, list[dict[str, Any]]()

    def add(self, picture: ReadPicture) -> None:
        """Add the next picture."""
        self._held.append(_described(picture, picture.picture) if picture.picture else {})
        if len(self._held) == PER_FILE:
            self.finish()

    def finish(self) -> None:
        """Write the rest, which does not fill a file."""
        if self._held:
            self.files.append(self._folder.add(DataFile({"pictures": self._held})))
            self._held = []


def _described(read: ReadPicture, picture: Picture) -> dict[str, Any]:
    """Return the picture's data for the page: its record, its files, and the radius up to which its lens is one to one;
    None for an endless one."""
    radius = invertible_radius(picture.camera.distortion)
    limit = radius if radius < float("inf") else None
    return {"record": picture.record, "lens_limit": limit, "files": read.keys.names}


def missing_files(pictures: Sequence[ReadPicture], present: set[str]) -> dict[int, PictureKeys]:
    """Return the keys of the files that are not `present`, by the place of the picture that they are made of. Where
    pictures share a file, it is made of the first."""
    begun, found = set(present), {}
    for place, picture in enumerate(pictures):
        keys = picture.keys.without(begun)
        if keys.image or keys.labels or keys.events:
            found[place] = keys
        begun |= set(picture.keys.names.values())
    return found


def write_files(
    pictures: Sequence[ReadPicture],
    missing: Mapping[int, PictureKeys],
    request: ShowOptions,
    work: Path,
    *,
    progress: Progress,
) -> dict[str, str]:
    """Let children write the `missing` files; return the faults, by the keys of files that could not be written.

    Raises OutputError if the gallery cannot be written, and ChildInternalError for an internal defect.
    """
    requests = [_request(pictures[place], keys, request, work) for place, keys in missing.items()]
    children = request.workers or max(1, min(len(usable_cpus()), len(requests) // PICTURES_PER_CHILD))
    faults: dict[str, str] = {}
    tasks = [Task(call=SHOW_PICTURE, request=each, tries=READING_TRIES, progress=progress) for each in requests]
    ended = done_in_order(tasks, children, start=lambda _: next_child(SHOW_PICTURE, writes=(request.page_folder,)))
    for done, (keys, task) in enumerate(zip(missing.values(), ended, strict=True)):
        progress("showing: picture", done, len(tasks))
        if isinstance(task.failure, OutputError):
            raise task.failure
        of_all = (keys.image, keys.labels, keys.events)
        faults |= dict.fromkeys(of_all, str(task.failure)) if task.failure else task.result
    progress("showing: picture", len(tasks), len(tasks))
    return faults


def _request(picture: ReadPicture, keys: PictureKeys, request: ShowOptions, work: Path) -> ShowPicture:
    return ShowPicture(
        dataset=picture.dataset,
        frame=picture.frame,
        variant=picture.variant,
        out=str(request.page_folder),
        work=str(work),
        images=request.images,
        keys=keys,
    )


def pictures_of(pictures: Sequence[ReadPicture]) -> tuple[Header, Arrays]:
    """Return the pictures in order: the numbers of frame and variant of each, and the key of its image."""
    frames = list(dict.fromkeys(picture.frame for picture in pictures))
    variants = list(dict.fromkeys(picture.variant for picture in pictures))
    keys = "".join(picture.keys.image or "0" * KEY_LENGTH for picture in pictures)
    arrays: Arrays = {
        "frame": _places([picture.frame for picture in pictures], frames),
        "variant": _places([picture.variant for picture in pictures], variants),
        "image": np.frombuffer(bytes.fromhex(keys), np.uint8),
    }
    return {"count": len(pictures), "frames": frames, "variants": variants}, arrays


def _places(names: Sequence[str], among: Sequence[str]) -> NDArray[np.uint32]:
    place = {name: number for number, name in enumerate(among)}
    return np.array([place[name] for name in names], np.uint32)


def measures_of(dataset: Dataset, columns: dict[str, Column], prefix: str = "") -> tuple[list[Header], Arrays]:
    """Return the measures of a dataset with these columns: the description and the numbers of each, under names that
    begin with the `prefix`. Measures that no picture has are left out."""
    found, arrays = [], {}
    for name, measure, place in described(len(dataset.targets)):
        if name in columns and np.isfinite(columns[name].numbers).any():
            target = None if place is None else dataset.targets[place].name
            found.append({"name": name, "title": measure.title, "unit": measure.unit, "target": target})
            arrays[prefix + name] = columns[name].numbers
    return found, arrays


def columns_of(columns: dict[str, Column], folder: GalleryFolder) -> Iterator[Header]:
    """Write the columns into separate files, and yield the description of each, except columns with a single value, and
    digests, which mean nothing to people."""
    for name, column in sorted(columns.items()):
        digests = bool(column.words) and all(map(DIGEST.fullmatch, column.words))
        if len(np.unique(column.numbers)) > 1 and not digests:
            file = folder.add(DataFile({"words": column.words}, {"numbers": column.numbers}))
            yield {"name": name, "file": file}


def described_dataset(dataset: Dataset, kinds: Sequence[str]) -> Header:
    """Return the data common to all pictures: targets, parts, and the labels of these kinds."""
    return {
        "spin_usd": __version__,
        "dataset": dataset.root.name,
        "targets": [_target(target) for target in dataset.targets],
        "parts": {
            str(part.id): [part.name, part.class_name, part.target, part.materials] for part in dataset.parts.values()
        },
        "labels": [_label(kind) for kind in kinds],
    }


def _target(target: Any) -> Header:
    return {
        "id": target.id,
        "name": target.name,
        "size": target.size.tolist(),
        "keypoints": list(target.keypoints.names),
    }


def _label(kind: str) -> Header:
    label = PIXEL_LABELS[kind]
    return {
        "kind": kind,
        "meaning": label.channels.meaning,
        "holds": list(label.channels.holds.values()),
        "unit": label.channels.unit,
        "colours": label.preview.__name__,
    }

"""The child's part of `show`: the files of one picture, from the dataset's decoded files."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import reading
from spin_usd.commands.show.data_file import DataFile
from spin_usd.commands.show.options import ORIGINAL, SMALL
from spin_usd.commands.show.picture_keys import IMAGE, PictureKeys, ShowPicture, visible_boxes
from spin_usd.errors import InputError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.formats.image_file import encoded_image
from spin_usd.geometry.region import Region
from spin_usd.labels import preview
from spin_usd.labels.table import LABELS
from spin_usd.reading.description import Description, read_description
from spin_usd.reading.events import EventStream
from spin_usd.reading.picture import INSTANCE, Picture, read_picture
from spin_usd.store.atomic import link_atomically, write_atomically
from spin_usd.store.names import events_of, record_of

THUMBNAIL_PX, SMALL_PX = 256, 960
ROOM = 1.25  # of a thumbnail of the targets, to their boxes
LEAST_PX = 16  # of its sides: fewer show nothing
QUALITY = 85
DENSE_POSE = "dense_pose"
EVENT_WINDOWS, EVENT_WINDOW_S = 8, 1 / 30  # from a picture on: as long as frames of video
STEP_M = 1e-5
"""Step to which the page rounds points of the dense pose: a hundredth of a millimetre."""
MAX_STEPS = 2**20  # 10 m: a dense pose that is further off is kept unchanged


def write_picture_files(request: ShowPicture) -> dict[str, str]:
    """Write the files of a picture that the gallery lacks; return what is wrong with those of the dataset, by the keys
    that could not be written."""
    name = record_of(request.variant, request.frame)
    picture = read_picture(Path(request.dataset), name, _description(request.dataset))
    writer = _PictureWriter(picture, Folder(Path(request.out)), Path(request.work))
    return dict(writer.faults(request.keys, request.images))


@cache
def _description(dataset: str) -> Description:
    return read_description(Path(dataset))


class _PictureWriter:
    """Writes files of a picture into the folder `out` by way of `work`."""

    def __init__(self, picture: Picture, out: Folder, work: Path) -> None:
        self._picture, self._out, self._work = picture, out, work

    def faults(self, keys: PictureKeys, images: str) -> Iterator[tuple[str, str]]:
        """Write all, and yield each key that could not be written, with the fault."""
        shown = self._preview if keys.preview else self._image
        image, labels, events = partial(shown, keys, images), partial(self._labels, keys), partial(self._events, keys)
        for key, write in ((keys.image, image), (keys.labels, labels), (keys.events, events)):
            try:
                with reading(f"{self._picture.frame} of {self._picture.variant}"):
                    if key:
                        write()
            except InputError as fault:
                yield (
                    key,
                    str(fault).replace(f"{self._picture.root}/", ""),
                )  # a recipient of the page has no such folder

    def _image(self, keys: PictureKeys, images: str) -> None:
        shown = preview.image(self._picture.image)
        grey = self._picture.image.ndim == 2
        if images == ORIGINAL:
            source = FileIn(Folder(self._picture.root), self._picture.files[IMAGE].path)
            link_atomically(self._out, keys.names["image"], source, work=self._work, copy=True)
        else:
            self._jpeg(keys.names["image"], preview.reduced(shown, SMALL_PX) if images == SMALL else shown, grey=grey)
        self._thumbnails(keys, shown, grey=grey)

    def _preview(self, keys: PictureKeys, images: str) -> None:
        label = LABELS[keys.preview].preview(self._picture.label(keys.preview))
        self._thumbnails(keys, label, grey=False)

    def _thumbnails(self, keys: PictureKeys, image: NDArray[np.uint8], *, grey: bool) -> None:
        around = region_of_targets(visible_boxes(self._picture.recorded), *image.shape[:2])
        self._jpeg(keys.names["thumbnail"], preview.reduced(image, THUMBNAIL_PX), grey=grey)
        self._jpeg(keys.names["of_target"], preview.reduced(image[around.slices], THUMBNAIL_PX), grey=grey)

    def _labels(self, keys: PictureKeys) -> None:
        labels = {kind: self._picture.label(kind) for kind in keys.kinds}
        script = label_file(self._picture, labels).script(keys.labels)
        write_atomically(self._out, keys.names["labels"], lambda: script, work=self._work)

    def _events(self, keys: PictureKeys) -> None:
        picture = self._picture
        assert picture.time_s is not None
        stream = EventStream(FileIn(Folder(picture.root), events_of(picture.variant)))
        data = event_file(stream, picture.time_s)
        write_atomically(self._out, keys.names["events"], lambda: data.script(keys.events), work=self._work)

    def _jpeg(self, name: str, image: NDArray[np.uint8], *, grey: bool) -> None:
        pixels, channels = (image[..., 0], ("Y",)) if grey else (image, ("R", "G", "B"))
        encode = partial(encoded_image, pixels, ".jpg", channels=channels, quality=QUALITY)
        write_atomically(self._out, name, encode, work=self._work)


def label_file(picture: Picture, labels: Mapping[str, NDArray[Any]]) -> DataFile:
    """Return the data file of these labels of the picture by their kinds, (H, W) or (H, W, C) each, in the format of
    the page: cropped to the box outside which all are 0.

    Numbers are exact to the last bit, except the dense pose, which is rounded to STEP_M if it agrees with the depth.
    """
    region = shown_region(labels)
    steps = steps_from_depth(picture, region, labels)
    described, arrays = {}, {}
    for kind, label in labels.items():
        pixels = np.atleast_3d(label[region.slices])
        described[kind] = {"dtype": label.dtype.name, "channels": pixels.shape[2]}
        if kind == DENSE_POSE and steps is not None:
            described[kind] |= {"dtype": "int32", "step_from_depth": STEP_M}
            pixels = steps
        arrays[kind] = packed(np.moveaxis(pixels, 2, 0))
    box = [region.x0, region.y0, region.x1, region.y1]
    return DataFile({"box": box, "labels": described}, arrays)


def event_file(stream: EventStream, start: float) -> DataFile:
    """Return the data file of EVENT_WINDOWS windows of time from `start` on: how many more events of a rise than of a
    fall each pixel has, 128 for none."""
    starts = [start + EVENT_WINDOW_S * place for place in range(EVENT_WINDOWS)]
    frames = (stream.frame(at, at + EVENT_WINDOW_S) for at in starts)
    more = np.stack([np.clip(rises - falls, -127, 127) + 128 for rises, falls in frames]).astype(np.uint8)
    sizes = {"width": stream.width, "height": stream.height, "windows": EVENT_WINDOWS, "window_s": EVENT_WINDOW_S}
    return DataFile(sizes, {"more": more})


def region_of_targets(boxes: Sequence[Sequence[float]], tall: int, wide: int) -> Region:
    """Return the part of a frame of these pixels that contains the boxes with a margin, in the frame's proportions; the
    whole frame without boxes."""
    if not boxes:
        return Region.full(wide, tall)
    (x0, y0), (x1, y1) = np.min(boxes, 0)[:2], np.max(boxes, 0)[2:]
    share = min(max((x1 - x0) / wide, (y1 - y0) / tall) * ROOM, 1.0)
    width, height = (min(max(round(share * side), LEAST_PX), side) for side in (wide, tall))
    left = min(max(round((x0 + x1 - width) / 2), 0), wide - width)
    top = min(max(round((y0 + y1 - height) / 2), 0), tall - height)
    return Region(x0=left, y0=top, x1=left + width, y1=top + height)


def shown_region(labels: Mapping[str, NDArray[Any]]) -> Region:
    """Return the region outside which all labels are 0; an empty one where they are so all over."""
    boxes = np.array([box for label in labels.values() if (box := _box(label))]).reshape(-1, 4)
    if not len(boxes):
        return Region(x0=0, y0=0, x1=0, y1=0)
    (x0, y0), (x1, y1) = boxes[:, :2].min(0).tolist(), boxes[:, 2:].max(0).tolist()
    return Region(x0=x0, y0=y0, x1=x1, y1=y1)


def _box(label: NDArray[Any]) -> tuple[int, int, int, int] | None:
    there = (label != 0).any(-1) if label.ndim == 3 else label != 0
    rows, columns = np.flatnonzero(there.any(1)), np.flatnonzero(there.any(0))
    return (int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1) if len(rows) else None


def packed(planes: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the bytes of the `planes` (C, H, W): first the lowest byte of every number, then the next, and so on.

    Numbers of 32 bits are first made small, for zlib: each is replaced by the difference of its bits, modulo 2^32, from
    a flat surface through its left, upper and upper left neighbours; the sign goes into the lowest bit. Summing along
    both axes undoes it.
    """
    numbers = np.ascontiguousarray(planes)
    if numbers.itemsize == 4:
        numbers = _differences(numbers.view(np.uint32))
    each = numbers.astype(numbers.dtype.newbyteorder("<")).view(np.uint8).reshape(-1, numbers.itemsize)
    return np.ascontiguousarray(each.T).reshape(-1)


def _differences(bits: NDArray[np.uint32]) -> NDArray[np.uint32]:
    for axis in (1, 2):
        bits = np.diff(bits, axis=axis, prepend=np.uint32(0))
    return (bits << np.uint32(1)) ^ (bits.view(np.int32) >> 31).view(np.uint32)


def steps_from_depth(picture: Picture, region: Region, labels: Mapping[str, NDArray[Any]]) -> NDArray[np.int32] | None:
    """Return (h, w, 3): by how many steps the dense pose in the `region` differs from `points_of_depth`; None where one
    of the labels that it takes is not there, or they are too far from each other for that.

    The page computes `points_of_depth` too. So a file need only hold these steps, which are next to nothing.
    """
    if not {"depth", "dense_pose"} <= set(labels) or not {INSTANCE, "segmentation"} & set(labels):
        return None
    left = labels["dense_pose"][region.slices] - points_of_depth(picture, region, labels)
    steps = np.rint(left / STEP_M)
    return steps.astype(np.int32) if (np.abs(steps) <= MAX_STEPS).all() else None


def points_of_depth(picture: Picture, region: Region, labels: Mapping[str, NDArray[Any]]) -> Float:
    """Return (h, w, 3): the point in the axes of the target seen in each pixel, by the depth, the camera and the pose,
    metres; 0 where no target is."""
    depth = labels["depth"][region.slices].astype(np.float64)
    ids = target_ids(picture, labels)[region.slices]
    rays = np.concatenate([picture.camera.centres(region), np.ones((*region.shape, 1))], -1)
    points = np.zeros((*region.shape, 3))
    for target in picture.targets:
        own = (ids == target.id) & (depth > 0)
        points[own] = (rays[own] * depth[own][:, None] - target.t_cam_body) @ target.T_cam_body[:3, :3]
    return points


def target_ids(picture: Picture, labels: Mapping[str, NDArray[Any]]) -> NDArray[np.uint16]:
    """Return (H, W): the id of the target that each pixel shows, by the instance, or else the part; 0 for none."""
    if INSTANCE in labels:
        return labels[INSTANCE]
    of_part = np.zeros(np.iinfo(np.uint16).max + 1, np.uint16)
    for part in picture.parts.values():
        if part.id < len(of_part):
            of_part[part.id] = part.target
    found: NDArray[np.uint16] = of_part[labels["segmentation"]]
    return found

"""Video: a file for each variant with its pictures in the order of the stage, to look at: MPEG-4 in an MP4.

Source: OpenCV's VideoWriter with its own FFmpeg, which encodes "mp4v" (MPEG-4 part 2) wherever OpenCV's wheel runs. It
drops the last column and the last row of an odd size, and takes sides of up to 8191 pixels.
"""

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import OutputError, UnsupportedError
from spin_usd.exchange.layout.export_format import ExportFormat, FormatOption, Layout, MadeFile, Output, from_one
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import eight_bits
from spin_usd.exchange.layout.survey import Survey
from spin_usd.geometry.camera import Camera
from spin_usd.reading.pictured_target import PicturedTarget

CODEC = "mp4v"
MAX_SIDE = 8190  # pixels, even
REAL, UNEVEN = "real", 0.01  # of a step
NOTHING, BOX, AXES, ALL = "none", "box", "axes", "all"
BOX_COLOUR = (0, 255, 255)  # of blue, green and red, as OpenCV has colours
AXIS_COLOURS = ((0, 0, 255), (0, 255, 0), (255, 0, 0))  # x red, y green, z blue
FAR = 2**20  # pixels: lines that end further off look the same, and OpenCV's numbers have 32 bits
CONVENTIONS = (
    "VARIANT.mp4 has the pictures of a variant, one a frame, in the order of the stage: pictures.csv lists them. To "
    "look at, for the code is lossy: MPEG-4, in 8 bits, colour at half the resolution.",
    "A frame of an odd width or height has its last column or row twice, for the code wants even ones.",
    "With overlay=box a yellow box is around the visible pixels of each target, with overlay=axes its body axes start "
    "at its origin, x red, y green, z blue, half as long as its longest side.",
)


def one_size(survey: Survey) -> None:
    """Raise UnsupportedError where pictures are of different sizes, or larger than the code has them."""
    sizes: dict[tuple[int, int], str] = {}
    for camera, picture in survey.cameras.items():
        sizes.setdefault((camera.width, camera.height), picture)
        if max(camera.width, camera.height) > MAX_SIDE:
            found = f"is {camera.width} x {camera.height} pixels, and MPEG-4 has {MAX_SIDE} a side at most"
            raise UnsupportedError(found, where=picture, do="render it with a smaller camera")
    if len(sizes) > 1:
        first, second = list(sizes.values())[:2]
        found = f"is of another size than {first}, and a video has one"
        raise UnsupportedError(found, where=second, do="choose variants of one size with --variants")


def frame_of(picture: ExportedPicture, overlay: str) -> NDArray[np.uint8]:
    """Return the picture (H, W, 3) in 8 bits in OpenCV's order of colours, blue first, H and W even, with its
    overlay."""
    image = eight_bits(picture.image)
    colours = np.repeat(image[..., None], 3, -1) if image.ndim == 2 else image[..., ::-1]
    frame = np.ascontiguousarray(np.pad(colours, ((0, len(image) % 2), (0, image.shape[1] % 2), (0, 0)), "edge"))
    for target in picture.targets:
        if target.pixels_visible and overlay in (BOX, ALL):
            _draw_box(frame, target)
        if overlay in (AXES, ALL):
            _draw_axes(frame, target, picture.camera)
    return frame


def _draw_box(frame: NDArray[np.uint8], target: PicturedTarget) -> None:
    import cv2

    x0, y0, x1, y1 = target.box_visible.astype(int).tolist()
    cv2.rectangle(frame, (x0, y0), (x1 - 1, y1 - 1), BOX_COLOUR, 1)


def _draw_axes(frame: NDArray[np.uint8], target: PicturedTarget, camera: Camera) -> None:
    import cv2

    ends = np.concatenate([np.zeros((1, 3)), np.eye(3) * np.ptp(target.box, axis=0).max() / 2])
    pixels = camera.project(ends @ target.T_cam_body[:3, :3].T + target.T_cam_body[:3, 3])
    origin, *tips = np.floor(np.clip(pixels, -FAR, FAR))
    for tip, colour in zip(tips, AXIS_COLOURS, strict=True):
        if np.isfinite([origin, tip]).all():
            cv2.line(frame, origin.astype(int).tolist(), tip.astype(int).tolist(), colour, 1, cv2.LINE_AA)


def _name(picture: ExportedPicture) -> str:
    return f"{picture.variant}.mp4"


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    """Yield the video that the picture is the last of, if it is."""
    if numbers := dataset.ended_by(picture):
        yield MadeFile(path=_name(picture), write=partial(_write_video, dataset, numbers))


def _write_video(dataset: ExportedDataset, numbers: list[int], path: Path) -> None:
    """Write the pictures of these numbers, and check that all are present: VideoWriter does not report a full disk."""
    import cv2

    overlay, fps = dataset.options["overlay"], dataset.options["fps"]
    rate = _real_rate(dataset, numbers) if fps == REAL else float(fps)
    frames = (frame_of(dataset.picture(number), overlay) for number in numbers)
    first = next(frames)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*CODEC), rate, first.shape[1::-1])
    if not writer.isOpened():
        found = f"cannot be written at {rate:g} pictures a second, which MPEG-4 does not hold"
        raise UnsupportedError(found, where=path.name, do="give fps a whole number")
    for frame in chain([first], frames):
        writer.write(frame)
    writer.release()
    held = cv2.VideoCapture(str(path))
    count = int(held.get(cv2.CAP_PROP_FRAME_COUNT))
    held.release()
    if count != len(numbers):
        found = f"holds {count} of {len(numbers)} frames after it was written"
        raise OutputError(found, where=path, do="free some space, or export fewer pictures")


def _real_rate(dataset: ExportedDataset, numbers: list[int]) -> float:
    """Return the pictures per second. Raises UnsupportedError if the rate is unknown, or not constant."""
    times = [dataset.picture(number).picture.time_s for number in numbers]
    known = np.array([time for time in times if time is not None])
    where, do = dataset.entries[numbers[0]].variant, "give fps a number"
    if len(known) < max(len(times), 2):
        raise UnsupportedError("has pictures without times, or one alone", where=where, do=do)
    step = (known[-1] - known[0]) / (len(known) - 1)
    if np.abs(known - known[0] - step * np.arange(len(known))).max() > UNEVEN * step:
        raise UnsupportedError("has pictures that are not equally far apart in time", where=where, do=do)
    return float(1 / step)


def _layout(options: Mapping[str, Any]) -> Layout:
    return Layout(
        needs=("image",),
        conventions=CONVENTIONS,
        files=_files,
        file=lambda dataset, picture: _name(picture),
        limits=(one_size,),
        splits={"train": "train"},
        several=True,
    )


VIDEO = ExportFormat(
    name="video",
    holds="as a video for each variant",
    layout=_layout,
    options=(
        FormatOption(
            name="fps",
            meaning="how many pictures a second, from 1; or real, as they were taken",
            default="10",
            read=lambda text: text if text == REAL else from_one(text),
        ),
        FormatOption(name="overlay", meaning="overlay on pictures", default=NOTHING, choices=(NOTHING, BOX, AXES, ALL)),
    ),
)

"""The frames of a stage: their names and time codes."""

from collections.abc import Sequence

import numpy as np
from pxr import Usd

from spin_usd.basics.utc import is_utc, utc_after
from spin_usd.errors import StageError, UnknownPictureError
from spin_usd.scene.poses import FRAME_NAME, FRAME_NAME_RULE, repeated_name
from spin_usd.scene.scene import FrameId
from spin_usd.stage.read.clock import Clock
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.root_metadata import root_number
from spin_usd.stage.usd.values import DEFAULT_TIME, TEXT, WHOLE, read, read_samples

MAX_FRAMES = 1_000_000  # frame_000000 has six digits


def read_frames(stage: Usd.Stage, variant: str) -> tuple[FrameId, ...]:
    """List one frame per time sample of spin:capture:frame on the default prim; else one per whole step from
    startTimeCode to endTimeCode; else one at the stage's start.

    Raises StageError for names that are not valid or not unique, and for a range that is reversed or too long.
    """
    prim = stage.GetDefaultPrim()
    attribute = prim.GetAttribute(schema.CAPTURE_FRAME) if prim else None
    named = read_samples(attribute, *TEXT) if attribute else []
    if named:
        _check_names([name for _, name in named], f"{prim.GetPath()}.{schema.CAPTURE_FRAME}")
    else:
        named = [(time, f"frame_{index:06d}") for index, time in enumerate(_time_range(stage))]
    files, seconds, epoch = _source_files(prim), Clock(stage).samples, _epoch(prim)
    return tuple(
        FrameId(
            index=i,
            name=name,
            time_code=time,
            variant=variant,
            source_file=files.get(time, ""),
            time_s=seconds.get(time),
            utc=utc_after(epoch, seconds[time]) if epoch and time in seconds else "",
        )
        for i, (time, name) in enumerate(named)
    )


def frame_named(frames: Sequence[FrameId], text: str, stage: object) -> FrameId:
    """Return the frame whose name is `text`, or whose place it is, counted from 0. Raises UnknownPictureError,
    which names the `stage`."""
    found = [frame for frame in frames if frame.name == text]
    if not found and text.isdecimal() and int(text) < len(frames):
        found = [frames[int(text)]]
    if not found:
        do = f"give a name such as {frames[0].name}, or a number from 0 to {len(frames) - 1}"
        raise UnknownPictureError(f"has no frame {text!r}", where=stage, do=do)
    return found[0]


def read_seed(stage: Usd.Stage) -> int:
    """Read the dataset's seed, 0 unless authored."""
    prim = stage.GetDefaultPrim()
    return int(read(prim.GetAttribute(schema.CAPTURE_SEED), DEFAULT_TIME, *WHOLE) or 0) if prim else 0


def _source_files(prim: Usd.Prim) -> dict[float, str]:
    """Map time codes to the image file for which the pose was given, if authored."""
    attribute = prim.GetAttribute(schema.CAPTURE_SOURCE_FILE) if prim else None
    return dict(read_samples(attribute, *TEXT)) if attribute else {}


def _epoch(prim: Usd.Prim) -> str:
    """Return the UTC of second 0; "" if not authored. Raises StageError for a value that is not UTC."""
    of_start = prim.GetAttribute(schema.CAPTURE_EPOCH) if prim else None
    epoch = str(read(of_start, DEFAULT_TIME, *TEXT) or "") if of_start else ""
    if epoch and not is_utc(epoch):
        do = "write it as 2026-11-26T12:00:00Z"
        raise StageError(f"is {epoch[:40]!r}, and no UTC", where=f"{prim.GetPath()}.{schema.CAPTURE_EPOCH}", do=do)
    return epoch


def _time_range(stage: Usd.Stage) -> list[float]:
    start, end = root_number(stage, "startTimeCode"), root_number(stage, "endTimeCode")
    if not stage.HasAuthoredTimeCodeRange():
        return [start]
    where = stage.GetRootLayer().realPath
    if not np.isfinite([start, end]).all() or end < start:
        found = f"endTimeCode {end:g} lies before startTimeCode {start:g}"
        raise StageError(found, where=where, do="swap them")
    count = int(np.floor(end - start)) + 1
    if count > MAX_FRAMES:
        found = f"startTimeCode {start:g} to endTimeCode {end:g} are {count} frames, more than {MAX_FRAMES}"
        raise StageError(found, where=where, do="shorten the range, or name the frames by spin:capture:frame")
    return [start + step for step in range(count)]


def _check_names(names: list[str], where: str) -> None:
    for name in names:
        if not FRAME_NAME.fullmatch(name):
            raise StageError(f"{name!r} is not a valid name for a frame", where=where, do=FRAME_NAME_RULE)
    if pair := repeated_name(names):
        found = f"'{names[pair[1]]}' names two frames (capitals do not count)"
        raise StageError(found, where=where, do="make the names unique")

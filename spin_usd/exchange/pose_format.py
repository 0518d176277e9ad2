"""A format of pose lists, and the pose that each of its entries holds."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class PoseEntry:
    """One pose of a file: the picture's file name, optionally with folders before it, the scalar-first unit quaternion
    q_cam_body, t_cam_body in metres, the line that it ends in, 0 if entries are counted instead, and the error of the
    file's matrix as a rotation. Conditions across entries, such as unique names, are checked for all formats alike."""

    filename: str
    q_cam_body: Sequence[float]
    t_cam_body: Sequence[float]
    line: int = 0
    off_rotation: float = 0.0
    time: float | datetime | None = None
    """When it is: seconds, or UTC."""
    epoch: datetime | None = None
    """UTC of second 0, if the file's times count from 1970."""


SCALAR_FIRST, SCALAR_LAST = (
    "a unit quaternion, scalar first (w, x, y, z)",
    "a unit quaternion, scalar last (x, y, z, w)",
)


@dataclass(frozen=True, kw_only=True)
class PoseFormat:
    """A format of pose lists."""

    name: str
    """For messages."""
    recognises: Callable[[Path, str], bool]
    """Whether a file is of it, from its path and its first characters."""
    read: Callable[[Path], Iterator[PoseEntry | str]]
    """Yields the file's entries in order, and between them notes for the user as text. Raises InputError that names the
    file and the entry."""
    lists: Callable[[Path], Sequence[Path]] = lambda folder: ()
    """Candidate lists in a data set's folder, in order; the format must also recognise them."""
    rotation: str = SCALAR_FIRST
    """Requirement on the file's own numbers of a rotation, in words."""


def files_like(*patterns: str) -> Callable[[Path], Sequence[Path]]:
    """Return a function that finds the files in a folder whose paths match one of the patterns, in their order."""
    return lambda folder: [file for pattern in patterns for file in sorted(folder.glob(pattern)) if file.is_file()]

"""The request to watch a stage, and the calls of the children that show it."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import NoneType

from msgspec import Struct

from spin_usd.commands.watch.options import WatchOptions
from spin_usd.processes.call import Call
from spin_usd.scene.effort import Effort

FileStates = Mapping[str, list[int] | None]
"""By path the file's inode, size and time of change in nanoseconds; None for a missing one."""


@dataclass(frozen=True, kw_only=True)
class WatchedPicture:
    """A picture by its frame, a name or a number from 0, and its variant."""

    frame: str
    variant: str


class OpenViewer(Struct, frozen=True, kw_only=True):
    """The request to open a renderer that shows stages."""

    renderer: str
    effort: Effort


class ViewStage(Struct, frozen=True, kw_only=True):
    """The request for a picture of a stage as it is now, small."""

    stage: str
    frame: str
    variant: str
    max_width: int
    """Largest number of columns of the picture, if possible."""
    labels: bool
    """Whether the usual labels are shown too."""


@dataclass(frozen=True, kw_only=True)
class WatchRequest:
    """The request of the command."""

    stage: Path
    """The root layer."""
    options: WatchOptions
    renderer: str
    """Renderer of the picture after the preview."""
    effort: Effort
    """Effort of that picture."""

    @property
    def choice(self) -> WatchedPicture:
        """First picture to show."""
        return WatchedPicture(frame=self.options.frame, variant=self.options.variant)

    def of(self, choice: WatchedPicture, *, labels: bool) -> ViewStage:
        """Return the request for a view of the picture."""
        return ViewStage(
            stage=str(self.stage.absolute()),
            frame=choice.frame,
            variant=choice.variant,
            max_width=self.options.max_width,
            labels=labels,
        )


class SeenPicture(Struct, frozen=True, kw_only=True):
    """A picture made by a viewer."""

    frame: str
    place: int
    frames: int
    """Number of frames of the stage."""
    variants: tuple[str, ...]
    notes: tuple[str, ...]
    pictures: dict[str, bytes]
    """PNGs of the image, and of labels by their names."""


class StageView(Struct, frozen=True, kw_only=True):
    """The answer of a viewer: a picture, or a fault."""

    files: FileStates = {}
    """States of the stage's files before they were read."""
    seen: SeenPicture | None = None
    fault: str = ""
    """Fault in a sentence."""
    unknown: bool = False
    """Whether the fault is that the stage has no such picture."""


OPEN_VIEWER = Call("spin_usd.commands.watch.in_child:Viewer", OpenViewer, NoneType)
VIEW_STAGE = Call("spin_usd.commands.watch.in_child:Viewer.view", ViewStage, StageView)


def states_of(paths: Iterable[str]) -> FileStates:
    """Return the states of these files now."""
    return {path: _state(path) for path in paths}


def _state(path: str) -> list[int] | None:
    try:
        found = os.stat(path)
    except OSError:
        return None
    return [found.st_ino, found.st_size, found.st_mtime_ns]

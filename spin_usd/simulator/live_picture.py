"""A picture that a simulator made, read like a picture of a dataset; other labels are made on first access."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.labels.table import LABELS
from spin_usd.picture.kinds import FILE_KINDS
from spin_usd.reading.picture import Picture
from spin_usd.records.record import Record
from spin_usd.store.read_documents import decoded_record
from spin_usd.studio.picture_request import PictureRequest

Arrays = dict[str, NDArray[Any]]
Made = tuple[Arrays, str]
"""Arrays by kind, and the record as JSON."""
RECORD = "record"


def _made_elsewhere(kind: str) -> Made:
    raise InputError(f"has no {kind}", do="request it from the simulator, in the process that made the picture")


@dataclass(frozen=True, kw_only=True, eq=False)
class LivePicture(Picture):
    """A picture in memory. `root` is the stage; there are no files.

    Attributes:
        request: the request: the same one makes the same picture again, to the bit.
        arrays: the arrays so far, by kind.
        make: makes another, or the record; a picture sent to another process has only the arrays it had.
        whole_camera: the camera of the whole picture.
    """

    recorded: Record = field(init=False)
    record_text: bytes = field(init=False)
    whole_camera: Camera
    request: PictureRequest
    arrays: Arrays
    make: Callable[[str], Made] = _made_elsewhere

    def __getattr__(self, name: str) -> Any:
        """Make the record's attributes on first access: it takes longer than some pictures."""
        if name not in ("recorded", "record_text"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        text = self.make(RECORD)[1].encode()
        self.__dict__.update(record_text=text, recorded=decoded_record(text, self.root))
        return self.__dict__[name]

    def __repr__(self) -> str:
        return f"LivePicture({self.frame!r} of {self.variant!r}, from {str(self.root)!r})"

    def __getstate__(self) -> dict[str, Any]:
        _ = self.recorded  # must be made before the picture leaves this process
        return {**super().__getstate__(), "make": _made_elsewhere}

    @property
    def _whole_camera(self) -> Camera:
        return self.whole_camera

    def _read(self, kind: str, rows: range | None) -> NDArray[Any]:
        if kind not in FILE_KINDS:
            raise InputError(f"there is no label {kind!r}", do=suggestion(kind, LABELS))
        if self.labels is not None and kind not in self.labels:
            raise InputError(f"has no {kind}", where=self.frame, do=f"add {kind} to its labels")
        if kind not in self.arrays:
            self.arrays.update(self.make(kind)[0])
        found = self.arrays[kind]
        return np.array(found if rows is None else found[rows.start : rows.stop : rows.step])

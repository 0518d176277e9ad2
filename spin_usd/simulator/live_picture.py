"""A picture that a simulator made, read as those of datasets are; other labels are made when they are asked for."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
"""Arrays by what they are, and the record as JSON."""
RECORD = "record"


def _made_elsewhere(kind: str) -> Made:
    raise InputError(f"has no {kind}", do="ask the simulator for it, where the picture was made")


@dataclass(frozen=True, kw_only=True, eq=False)
class LivePicture(Picture):
    """A picture in memory. `root` is the stage; there are no files.

    Attributes:
        request: what was asked for: the same is the same picture again, to the bit.
        arrays: those that are made, by what they are.
        make: makes another, or the record; a picture that went to another process has those alone that it had.
        whole_camera: the camera of the whole picture.
    """

    recorded: Record = field(init=False)
    record_text: bytes = field(init=False)
    whole_camera: Camera
    request: PictureRequest
    arrays: Arrays
    make: Callable[[str], Made] = _made_elsewhere

    def __getattr__(self, name: str) -> Any:
        """Have what the record says made when it is first asked for: it takes longer than some pictures."""
        if name not in ("recorded", "record_text"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        text = self.make(RECORD)[1].encode()
        self.__dict__.update(record_text=text, recorded=decoded_record(text, self.root))
        return self.__dict__[name]

    def __repr__(self) -> str:
        return f"LivePicture({self.frame!r} of {self.variant!r}, from {str(self.root)!r})"

    def __getstate__(self) -> dict[str, Any]:
        _ = self.recorded  # is made here, as long as it can be
        return {**super().__getstate__(), "make": _made_elsewhere}

    @property
    def _whole_camera(self) -> Camera:
        return self.whole_camera

    def _read(self, kind: str, rows: range | None) -> NDArray[Any]:
        if kind not in FILE_KINDS:
            raise InputError(f"there is no label {kind!r}", do=f"choose among {', '.join(LABELS)}")
        if self.labels is not None and kind not in self.labels:
            raise InputError(f"has no {kind}", where=self.frame, do=f"ask for {kind} among its labels")
        if kind not in self.arrays:
            self.arrays.update(self.make(kind)[0])
        found = self.arrays[kind]
        return np.array(found if rows is None else found[rows.start : rows.stop : rows.step])

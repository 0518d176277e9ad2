"""Messages between `serve` and its clients, as msgpack: maps with these keys."""

from typing import Any

from msgspec import UNSET, Struct, UnsetType

from spin_usd.records.record import RecordedCamera, RecordedPose

MAX_MESSAGE = 1 << 20  # bytes that a client may send


class Asked(Struct, forbid_unknown_fields=True, kw_only=True):
    """A message to the server. `ask` is "picture", "stage" or "ping"; the other fields are for pictures, as in
    `Simulator.request`."""

    ask: str = "picture"
    arrays: tuple[str, ...] = ("image",)
    """Kinds of array to send."""
    record: bool = False
    """Whether to send the record too."""
    frame: str | int | None = None
    pose: Any = None
    sun: list[float] | None = None
    exposure: float | None = None
    lights: dict[str, float] | None = None
    parts: dict[str, Any] | None = None
    values: dict[str, Any] | None = None
    time: float | None = None
    variant: str | None = None
    seed: int | None = None
    name: str | None = None


class SentArray(Struct, frozen=True, kw_only=True):
    """An array, row by row from the top, in the byte order of its type."""

    dtype: Any
    """Type as numpy describes it, such as "|u1"; of a table a list of columns."""
    shape: list[int]
    data: bytes


class SentPicture(Struct, frozen=True, kw_only=True):
    """A picture: metres, pixels, OpenCV's camera axes."""

    frame: str
    variant: str
    index: int
    camera: RecordedCamera
    pose: RecordedPose
    arrays: dict[str, SentArray]
    logged: int | UnsetType = UNSET
    """Place in the log."""
    record: str | UnsetType = UNSET
    """JSON."""


class SentError(Struct, frozen=True, kw_only=True):
    """Reason why there is no picture, in a sentence."""

    error: str


class SentStage(Struct, frozen=True, kw_only=True):
    """The served stage."""

    frames: list[str]
    variants: list[str]
    seed: int
    targets: dict[str, dict[str, list[float]]]
    """Keypoints of each target by name, metres, its own axes."""
    version: str


class SentPong(Struct, frozen=True, kw_only=True):
    """The server's reply to "ping"."""

    waiting: int
    """Requested pictures that are not made yet."""

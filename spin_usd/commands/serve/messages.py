"""Messages between `serve` and its clients, as msgpack: maps with these keys."""

from typing import Any

from msgspec import UNSET, Struct, UnsetType

from spin_usd.records.record import RecordedCamera, RecordedPose

MAX_MESSAGE = 1 << 20  # bytes that a client may send


class Asked(Struct, forbid_unknown_fields=True, kw_only=True):
    """A message to the server. `ask` is "picture", "stage" or "ping"; the rest is of pictures, as `Simulator.request`
    has it."""

    ask: str = "picture"
    arrays: tuple[str, ...] = ("image",)
    """Kinds of array that are sent."""
    record: bool = False
    """Whether the record is sent too."""
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
    """An array, row by row from the top, in the byte order that its type names."""

    dtype: Any
    """As numpy describes it, such as "|u1"; of a table a list of columns."""
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
    """Its place in the log."""
    record: str | UnsetType = UNSET
    """JSON."""


class SentError(Struct, frozen=True, kw_only=True):
    """Why there is no picture, in a sentence."""

    error: str


class SentStage(Struct, frozen=True, kw_only=True):
    """What is served."""

    frames: list[str]
    variants: list[str]
    seed: int
    targets: dict[str, dict[str, list[float]]]
    """By name the keypoints of each, metres, its own axes."""
    version: str


class SentPong(Struct, frozen=True, kw_only=True):
    """That the server is there."""

    waiting: int
    """Pictures that are asked for and not made."""

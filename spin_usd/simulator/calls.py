"""The calls of children that make pictures in memory: of a stage, of its log, and of a dataset developed anew."""

from types import NoneType
from typing import Any

from msgspec import Struct

from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.call import Call
from spin_usd.records.descriptions import PartEntry, TargetEntry
from spin_usd.records.record import RecordedCamera, RecordedPose
from spin_usd.simulator.shared_arrays import Entry
from spin_usd.studio.picture_request import PictureRequest


class OpenLog(Struct, frozen=True, kw_only=True):
    """The log of a simulator."""

    folder: str
    parts: tuple[str, ...] = ()
    """Parts of the first target that requests may move."""
    redo: tuple[tuple[int, PictureRequest], ...] = ()
    """Numbers and requests of earlier pictures, which may be missing from the log: they were not saved."""


class OpenSimulator(Struct, frozen=True, kw_only=True):
    """The request to open a stage for pictures in memory."""

    stage: str
    """Root layer."""
    options: WorkerOptions
    variant: str
    """Variant of requests that name none."""
    seed: int | None
    """Seed of all that is random; None for the stage's own."""
    memory: int
    """File descriptor of SharedArrays."""
    cpus: list[int]
    """Processors that it may use."""
    log: OpenLog | None = None
    """Log of the requests; None for none."""


class OpenedSimulator(Struct, frozen=True, kw_only=True):
    """A stage that is open for pictures in memory."""

    frames: list[str]
    variants: list[str]
    seed: int
    targets: list[TargetEntry]
    parts: dict[str, PartEntry]
    logged: int = 0
    """Number of pictures in its log."""


class SimulatePicture(Struct, frozen=True, kw_only=True):
    """The request for a picture in memory."""

    picture: PictureRequest
    kinds: tuple[str, ...]
    """Kinds of array to return."""
    recorded: bool = False
    """Whether to return the record too; it takes longer than some arrays."""
    number: int | None = None
    """Place in the log; None without a log."""


class MadeInMemory(Struct, frozen=True, kw_only=True):
    """A picture whose arrays are in memory."""

    frame: str
    variant: str
    index: int
    camera: RecordedCamera
    pose: RecordedPose
    arrays: list[Entry]
    """Entries of SharedArrays."""
    request: PictureRequest | None = None
    """Request for the same picture with the drawn values, where values were drawn."""
    record: str | None = None
    """Record as JSON, where it was requested."""
    saved: bool = True
    """Whether all of the log is on disk."""


class OpenFresh(Struct, frozen=True, kw_only=True):
    """The request to open a dataset whose images are developed anew."""

    dataset: str
    spec: str
    """File of the specification of augmentations."""
    seed: int
    memory: int
    """File descriptor of SharedArrays."""


class DevelopImage(Struct, frozen=True, kw_only=True):
    """The request to develop the image of a stored picture anew."""

    frame: str
    variant: str
    epoch: int
    region: tuple[int, int, int, int] | None = None
    """Part of the image, x0, y0, x1, y1; None for all of it."""


class DevelopedImage(Struct, frozen=True, kw_only=True):
    """A stored picture's image developed anew."""

    arrays: list[Entry]
    """Entries of SharedArrays."""
    augmentation: str
    """Augmentation that was drawn."""
    values: dict[str, Any]
    """Drawn values by parameter."""


OPEN_SIMULATOR = Call("spin_usd.simulator.in_child:StagePictures", OpenSimulator, OpenedSimulator)
SIMULATE_PICTURE = Call("spin_usd.simulator.in_child:StagePictures.picture", SimulatePicture, MadeInMemory)
SAVE_LOG = Call("spin_usd.simulator.in_child:StagePictures.save_log", NoneType, NoneType)
OPEN_FRESH = Call("spin_usd.simulator.fresh_images:FreshImages", OpenFresh, NoneType)
DEVELOP_IMAGE = Call("spin_usd.simulator.fresh_images:FreshImages.image", DevelopImage, DevelopedImage)

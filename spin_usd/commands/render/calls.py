"""The calls of children that render: one opens a worker, the others make its pictures."""

from msgspec import Struct

from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.call import Call


class OpenWorker(Struct, frozen=True, kw_only=True):
    """The request to open a worker."""

    options: WorkerOptions
    cpus: list[int] = []
    """Processors that it may use; empty for all."""


class MakePicture(Struct, frozen=True, kw_only=True):
    """The request for a picture of a dataset."""

    variant: str
    index: int
    """Place of the frame in the stage."""
    kinds: tuple[str, ...]
    """Wanted kinds of file."""
    keep_render: bool = True
    """Whether the cache stores the render for other pictures."""
    keep_labels: bool = True
    """Whether the cache stores the labels for other pictures."""


class MadePicture(Struct, frozen=True, kw_only=True):
    """A picture that a worker has made."""

    record: str
    """Name of the record."""
    seconds: dict[str, float]
    """Seconds by kind of work."""
    memory: int
    """Bytes of memory that the worker uses now."""
    passes: dict[str, str]
    """For "labels" and "render", where the picture has them: "made" now, or "shared" with others."""
    faults: tuple[str, ...]
    """Faults, as picture.brightness names them."""


OPEN_WORKER = Call("spin_usd.commands.render.worker:RenderWorker", OpenWorker, dict[str, str])
MAKE_PICTURE = Call("spin_usd.commands.render.worker:RenderWorker.picture", MakePicture, MadePicture)

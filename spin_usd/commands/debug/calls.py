"""The call of the child that writes a .blend."""

from msgspec import Struct

from spin_usd.processes.call import Call
from spin_usd.scene.effort import Effort


class WriteBlend(Struct, frozen=True, kw_only=True):
    """The request to write a picture's scene as a .blend."""

    stage: str
    frame: str
    """Name of the frame, or its number from 0."""
    variant: str
    effort: Effort
    seed: int | None
    """Seed of the dataset; None for the stage's own."""
    file: str
    """New file to write."""


class WrittenBlend(Struct, frozen=True, kw_only=True):
    """A .blend that was written."""

    frame: str
    """Name of the frame."""
    notes: tuple[str, ...]
    """Sentences on differences between the render and the stage."""


WRITE_BLEND = Call("spin_usd.commands.debug.in_child:write_blend", WriteBlend, WrittenBlend)

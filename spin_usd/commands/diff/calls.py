"""The call of the child that compares two variants of a stage."""

from msgspec import Struct

from spin_usd.processes.call import Call
from spin_usd.records.difference import DiffReport


class CompareVariants(Struct, frozen=True, kw_only=True):
    """The request to compare two variants, each as Selection.parse reads it."""

    stage: str
    before: str
    after: str
    frames: str | None = None
    """Slice of the frames, such as 0:10; None for all."""


COMPARE_VARIANTS = Call("spin_usd.commands.diff.in_child:compare", CompareVariants, DiffReport)

"""Metadata of a stage's root layer, in whatever numeric type a program stored it.

USD declares them double and raises on a float, which crate files by some exporters hold.
"""

from pxr import Usd

from spin_usd.errors import StageError

METRES_PER_UNIT = "metersPerUnit"
UNITS = 1e-12, 1e17
"""The shortest and the longest unit that there is a use for, metres: a picometre, some parsecs."""


def root_number(stage: Usd.Stage, name: str) -> float:
    """Return the metadatum `name` of the root layer, or USD's fallback. Raises StageError unless it is a number."""
    value = stage.GetMetadata(name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        where = stage.GetRootLayer().realPath
        raise StageError(f"{name} is {value!r}", where=where, do="author a number")
    return float(value)

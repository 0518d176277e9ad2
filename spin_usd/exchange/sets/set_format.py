"""A layout of a data set of somebody else: how its folder is recognised and read."""

from collections.abc import Callable
from dataclasses import dataclass

from spin_usd.audit.annotated_set import AnnotatedSet
from spin_usd.exchange.sets.set_folder import SetFolder


@dataclass(frozen=True, kw_only=True)
class PoseFields:
    """Where the files of a layout hold poses, for a repaired copy."""

    files: str
    """Pattern of the paths of the lists."""
    rotation: tuple[str, ...]
    """Keys that can hold the quaternion or the matrix of a JSON entry, or the columns of a table."""
    position: tuple[str, ...]
    """The same of the position."""
    name: str = ""
    """The key or column with the image's name; "" where there is none."""
    scalar_last: bool = False
    """Whether the quaternion's scalar is the last number."""


@dataclass(frozen=True, kw_only=True)
class SetFormat:
    """A layout that `check` reads."""

    name: str
    """As the exports are named."""
    recognises: Callable[[SetFolder], str]
    """Returns the reasons to think that the folder has this layout, as a phrase; "" for none."""
    read: Callable[[SetFolder], AnnotatedSet]
    """Reads the labels. Faults of single entries go into the folder's faults."""
    fields: PoseFields | None = None
    """Where poses are; None if the layout has none."""

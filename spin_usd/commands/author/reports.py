"""Reports of what `author` and `augment` made, sent from the child process to the caller."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from msgspec import Struct

from spin_usd.processes.call import Call
from spin_usd.scene.derived.views import Views


@dataclass(frozen=True, kw_only=True)
class AuthorReport:
    """A stage that author wrote."""

    root: str
    """Its root layer's path."""
    frames: int
    """How many pictures it has."""
    target: str
    """Name of the target, the first where pictures show several in turn."""
    meshes: int
    """How many the target has."""
    camera: str
    """The camera's file."""
    views: Views
    """Summary of what the pictures show."""
    notes: tuple[str, ...]
    """Notes for the user."""
    sizes: Mapping[str, float] = field(default_factory=dict)
    """Longest edge of the bounding box of each craft that pictures show in turn, metres, by its name."""


@dataclass(frozen=True, kw_only=True)
class AugmentReport:
    """Augmentations that augment wrote."""

    root: str
    """The path of the root layer that has them."""
    augmentations: tuple[str, ...]
    """Their names."""
    spec: str
    """The specification's name."""


class AugmentStage(Struct, frozen=True, kw_only=True):
    """The request for the variants of a specification."""

    stage: str
    spec: str
    """Name or file of the specification."""
    out: str | None = None
    """New root layer beside the stage; None to write over it."""


class ParameterRow(Struct, frozen=True, kw_only=True):
    """A parameter that a specification can sample."""

    name: str
    units: tuple[str, ...] = ()
    """Units that it can be given in; none for plain numbers."""
    takes: str
    """Values in the first of its units."""
    per_frame: bool
    """True if its value can differ from picture to picture."""
    description: str


AUTHOR = Call("spin_usd.commands.author.in_child:author_requested", dict[str, Any], AuthorReport)
AUGMENT = Call("spin_usd.commands.author.augment:augment_requested", AugmentStage, AugmentReport)

"""Reports of what `author` and `augment` made, sent from the child process to the caller."""

from dataclasses import dataclass

from spin_usd.scene.derived.views import Views


@dataclass(frozen=True, kw_only=True)
class AuthorReport:
    """A stage that author wrote."""

    root: str
    """Its root layer's path."""
    frames: int
    """How many pictures it has."""
    target: str
    """The target's name."""
    meshes: int
    """How many the target has."""
    camera: str
    """The camera's file."""
    views: Views
    """Summary of what the pictures show."""
    notes: tuple[str, ...]
    """Notes for the user."""


@dataclass(frozen=True, kw_only=True)
class AugmentReport:
    """Augmentations that augment wrote."""

    root: str
    """The path of the root layer that has them."""
    augmentations: tuple[str, ...]
    """Their names."""
    spec: str
    """The specification's name."""

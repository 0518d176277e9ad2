"""Reports of what `author` and `augment` made, sent from the child process to the caller."""

from dataclasses import dataclass

from spin_usd.scene.derived.views import Views


@dataclass(frozen=True, kw_only=True)
class AuthorReport:
    """A stage that author wrote.

    root: its root layer's path · frames: how many pictures it has · target: the target's name · meshes: how many it has
    · camera: the camera's file · views: what the pictures show · notes:
    sentences on what a user should know.
    """

    root: str
    frames: int
    target: str
    meshes: int
    camera: str
    views: Views
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class AugmentReport:
    """Augmentations that augment wrote.

    root: the path of the root layer that has them · augmentations: their names · spec: the specification's name.
    """

    root: str
    augmentations: tuple[str, ...]
    spec: str

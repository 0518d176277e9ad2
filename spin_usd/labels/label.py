"""Labels: kinds of ground truth, of every pixel of a picture or of every point that its LiDAR measures."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import digest
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.scene.channels import Channels
from spin_usd.scene.content import content
from spin_usd.scene.derived.content_keys import placed
from spin_usd.scene.derived.echoes import Echoes
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class LabelFile(ABC):
    """Properties of the files of a label, independent of its inputs."""

    name: str
    """In `--labels`, as the folder of its files, and in records; lower-case letters, digits and "_"."""
    channels: Channels
    """Meaning of the numbers; dataset.json contains `channels.meaning`."""
    suffix: str
    """Suffix of its files."""
    file_bytes: float
    """Compressed bytes per pixel of the target, for the estimate of `plan`."""
    preview: Callable[[NDArray[Any]], NDArray[np.uint8]]
    """The label in colours for people, (H, W, 3) uint8 RGB."""
    faults: Callable[[LabelledPicture], Iterator[LabelFault]]
    """Faults that `check` reports for a picture with this label."""
    target_s: float = 0.0
    """Seconds of one core per pixel of the target, beyond work shared by labels; for `plan`."""
    default: bool = False
    """Whether `render` writes it when no labels are named."""

    @abstractmethod
    def key(self, scene: Scene, geometry: str, seed: int) -> str:
        """Return the digest of all that decides the label in `scene`, whose geometry key and seed are given: that key,
        where nothing else does; "" where the scene cannot have it."""


@dataclass(frozen=True, kw_only=True)
class Label(LabelFile):
    """A label of every pixel. All that describes it stands here, and in LabelFile.

    The suffix is ".exr" for float32, ".png" for uint8 and uint16. Channels are called Y, or R, G and B, whatever they
    hold: OpenCV's EXR reader reads no other names and silently gives zeros for them.
    """

    make: Callable[[Scene, Surface], NDArray[Any]]
    """The label (H, W), or (H, W, C) where it has several channels, of a scene and its visible surface."""
    usd_type: str
    """USD type of a pixel; authored stages list the default labels as UsdRender variables."""
    decided_by: Callable[[Scene], Any] | None = None
    """Inputs of the label beyond the geometry key, which covers all other labels."""
    takes: Literal["next_frame", "paired"] | None = None
    """Another view that `make` and `decided_by` take: scene.next_frame or scene.paired, by its name."""
    max_targets: int | None = None
    """How many targets it can hold; any number if not given."""
    of_several: bool = False
    """Whether `render` writes it beside any other label if a stage has several bodies, to tell which of them another
    label is of."""

    def key(self, scene: Scene, geometry: str, seed: int) -> str:
        if self.takes == "paired" and scene.paired is None:
            return ""
        return digest(geometry, content(self.decided_by(scene))) if self.decided_by else geometry


@dataclass(frozen=True, kw_only=True)
class CloudLabel(LabelFile):
    """A label of every point that the scene's LiDAR measures; only stages with a LiDAR have it.

    The suffix is ".npz" or ".ply". Its key covers the LiDAR, the bodies and their poses, and the seed if some of the
    points are random; not the camera, nor the renderer.
    """

    make: Callable[[Scene, Echoes, np.random.Generator], NDArray[np.void]]
    """The points (N,), an array with named columns, from a scene, the hits of its beams, and a random generator."""

    def key(self, scene: Scene, geometry: str, seed: int) -> str:
        if scene.lidar is None:
            return ""
        bodies = [[*placed(body), before] for body, before in zip(scene.bodies, scene.part_offsets, strict=True)]
        return digest(content([scene.lidar, seed if scene.lidar.by_chance else None]), bodies)

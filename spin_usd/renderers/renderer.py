"""The interfaces of renderers, which `raycast` and `blender` implement, of casters that find the faces of labels, and
of writers of a scene for people to open."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.effort import Effort
from spin_usd.scene.passes import Radiance, Visibility
from spin_usd.scene.scene import Scene


class Renderer(Protocol):
    """Renders scenes one after another, keeping open whatever does not change between them.

    It makes images alone. The labels of a run are of no renderer: see LabelPass.
    """

    name: str

    def radiance(self, scene: Scene, effort: Effort, *, seed: int) -> Radiance:
        """Return linear radiance and coverage of `scene.picture_region`, averaged over each pixel's own square with so
        much effort, by rays that `seed` spreads. Nothing that lies behind the target is in it. It is given by light
        group: one plane for each of scene.derived.light_groups.LightGroups.of(scene), in that order, also for a group
        whose light does not reach the target. Raises RenderError when the renderer fails."""
        ...

    def versions(self) -> dict[str, str]:
        """Return names and versions of the software that decides the result."""
        ...

    def close(self) -> None:
        """Release everything."""
        ...


@runtime_checkable
class LabelPass(Protocol):
    """Finds the face at each pixel, for labels.

    Every run uses Embree's (embree.caster). Cycles' (blender.renderer) shares no code with it and checks it: in tests,
    in `measure`, and in `check --cross`.
    """

    name: str

    def visibility(self, scene: Scene) -> Visibility:
        """Return the face behind every pixel centre of `scene.region`; without depth of field or motion blur."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class OpenableScene:
    """A scene as people open it in a renderer's own program."""

    scene: Scene
    """The scene with its actual lights."""
    effort: Effort
    """Effort of the render that the program will make."""
    seed: int
    """Seed of the same render."""
    behind: NDArray[np.float32] | None
    """(H, W, 3), W/m2/sr, of the whole frame: the background; None for black."""
    camera_path: str
    """The camera's prim."""
    exposure: float
    """The factor from radiance to the screen's white, for the eye alone."""
    readme: Sequence[str]
    """Text that describes the file."""


class SceneWriter(Protocol):
    """Writes a scene into a file that a renderer's own program opens and renders, without any of our code."""

    def write(self, openable: OpenableScene, file: Path) -> None:
        """Write the new `file`. Raises RenderError where it does not read back, UnsupportedError as the renderer."""
        ...

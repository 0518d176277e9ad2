"""The interface of renderers; `raycast` and `blender` implement it."""

from typing import Protocol

from spin_usd.scene.effort import Effort
from spin_usd.scene.model import Scene
from spin_usd.scene.passes import Radiance, Visibility


class Renderer(Protocol):
    """Renders scenes one after another, keeping open whatever does not change between them.

    Both methods look only at the scene's region of that kind, and raise RenderError when the renderer fails.
    """

    name: str

    def visibility(self, scene: Scene) -> Visibility:
        """Return the face behind every pixel centre of `scene.region`; without depth of field or motion blur."""
        ...

    def radiance(self, scene: Scene, effort: Effort, *, seed: int) -> Radiance:
        """Linear radiance and coverage of `scene.picture_region`, averaged over each pixel's own square with so
        much effort, by rays that `seed` spreads. Nothing that lies behind the target is in it. It is given by light
        group: one plane for each of scene.light_groups.Groups.of(scene), in that order, also for a group whose light
        does not reach the target."""
        ...

    def versions(self) -> dict[str, str]:
        """Return names and versions of the software that decides the result."""
        ...

    def close(self) -> None:
        """Release everything."""
        ...

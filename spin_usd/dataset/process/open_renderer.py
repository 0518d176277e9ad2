"""The renderers by name, each loaded when it is opened: one of them needs Blender."""

from collections.abc import Collection

from spin_usd.errors import UnsupportedError
from spin_usd.renderers.renderer import Renderer


def open_renderer(name: str, *, crop: bool = True, keep: Collection[str] = ()) -> Renderer:
    """Open the renderer `name`: `blender` or `raycast`.

    Without `crop` Blender renders whole frames instead of the target's part of them, to the same bytes; with `keep` it
    does the work that these rules would skip, to the same picture as surely as each rule says. Raises UnsupportedError
    for any other name.
    """
    if name == "raycast":
        from spin_usd.renderers.raycast.renderer import RaycastRenderer

        return RaycastRenderer()
    if name == "blender":
        from spin_usd.renderers.blender.renderer import BlenderRenderer

        return BlenderRenderer(crop=crop, keep=keep)
    raise UnsupportedError(f"there is no renderer {name!r}", do="choose blender or raycast")

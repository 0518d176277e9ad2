"""What is asked of `render` and `plan`, with an effort as it is."""

from pathlib import Path

from spin_usd.options import PictureOptions
from spin_usd.planning.request import RenderRequest
from spin_usd.processes.open_renderer import DEFAULT_RENDERER, default_effort
from spin_usd.scene.effort import Effort


def request_for(stage: Path, *, effort: Effort | None = None, **options) -> RenderRequest:
    """The request for pictures of the stage by `options` of PictureOptions, and this effort or the usual one."""
    usual = effort or default_effort(options.get("renderer") or DEFAULT_RENDERER)
    return RenderRequest(options=PictureOptions(stage, **options), effort=usual)

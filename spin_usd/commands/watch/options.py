"""The options of `watch`."""

from dataclasses import KW_ONLY, dataclass
from typing import Annotated

from spin_usd.options import Frame, Option, Options, RendererName, Stage, Variant

PORT = 8643
MAX_WIDTH = 960


@dataclass(frozen=True)
class WatchOptions(Options):
    """The picture to show first, and the way to show it."""

    stage: Stage
    _: KW_ONLY
    frame: Frame
    variant: Variant = "nominal"
    renderer: RendererName = None
    quality: Annotated[str, Option("Quality of the picture after the preview: preview, draft ...", "NAME")] = "draft"
    max_width: Annotated[int, Option("Largest width of a picture.", "PIXELS", at_least=16)] = MAX_WIDTH
    port: Annotated[int, Option("Port of the page; 0 for any free port.", "N")] = PORT
    terminal: Annotated[bool, Option("Also show the picture in this terminal.")] = False

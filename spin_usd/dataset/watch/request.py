"""What is watched, and what of it is shown."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spin_usd.dataset.process.open_renderer import DEFAULT_RENDERER
from spin_usd.scene.effort import QUALITIES, Effort

PORT = 8643
MAX_WIDTH = 960


@dataclass(frozen=True, kw_only=True)
class WatchedPicture:
    """A picture by its frame, a name or a number from 0, and its variant."""

    frame: str
    variant: str


@dataclass(frozen=True, kw_only=True)
class WatchRequest:
    """What is asked of the command. stage: the root layer · choice: the picture shown first · renderer: what renders
    light after the preview, "raycast" for the preview alone · effort: of that render · max_width: of the pictures,
    pixels · port: where the page is served, any free one for 0."""

    stage: Path
    choice: WatchedPicture
    renderer: str = DEFAULT_RENDERER
    effort: Effort = QUALITIES["draft"]
    max_width: int = MAX_WIDTH
    port: int = PORT

    def of(self, choice: WatchedPicture) -> dict[str, Any]:
        """Return the arguments of a child's `view` of the picture."""
        view = {"frame": choice.frame, "variant": choice.variant, "max_width": self.max_width}
        return {"stage": str(self.stage.absolute()), **view}

"""What is watched, and what of it is shown."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spin_usd.commands.watch.options import WatchOptions
from spin_usd.scene.effort import Effort


@dataclass(frozen=True, kw_only=True)
class WatchedPicture:
    """A picture by its frame, a name or a number from 0, and its variant."""

    frame: str
    variant: str


@dataclass(frozen=True, kw_only=True)
class WatchRequest:
    """What is asked of the command.

    stage: the root layer
    renderer, effort: of the picture after the preview
    """

    stage: Path
    options: WatchOptions
    renderer: str
    effort: Effort

    @property
    def choice(self) -> WatchedPicture:
        """The picture that is shown first."""
        return WatchedPicture(frame=self.options.frame, variant=self.options.variant)

    def of(self, choice: WatchedPicture) -> dict[str, Any]:
        """Return the arguments of a child's `view` of the picture."""
        view = {"frame": choice.frame, "variant": choice.variant, "max_width": self.options.max_width}
        return {"stage": str(self.stage.absolute()), **view}

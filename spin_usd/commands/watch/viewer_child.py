"""A child that views pictures, kept warm between them; one that dies is replaced."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from spin_usd.processes.child_limits import START_PATIENCE_S, rendering_memory
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.lasting_child import LastingChild
from spin_usd.processes.open_renderer import renderer_entry
from spin_usd.scene.effort import Effort

VIEWING_MODULE = "spin_usd.commands.watch.in_child"  # named as text: it loads USD


class ViewerChild(LastingChild):
    """A child with one renderer. It is started at once."""

    def __init__(self, renderer: str, effort: Effort) -> None:
        super().__init__(memory=rendering_memory(), modules=(VIEWING_MODULE, renderer_entry(renderer).module))
        self._opened: dict[str, Any] = {"renderer": renderer, "effort": asdict(effort)}
        self._is_open = False
        self.start()

    def view(self, arguments: Mapping[str, Any], *, labels: bool, within_s: float) -> dict[str, Any]:
        """Return what `Viewer.view` does, within so many seconds. Raises ChildDiedError where the child ended; the next
        call has another."""
        try:
            if not self._is_open:
                self.call("open_viewer", within_s=START_PATIENCE_S, **self._opened)
                self._is_open = True
            answer: dict[str, Any] = self.call("view", within_s=within_s, **arguments, labels=labels)
        except ChildDiedError:
            self._is_open = False
            self.start()
            raise
        return answer

    def replace(self) -> None:
        """End the child at once, and start another."""
        self.end()
        self._is_open = False
        self.start()

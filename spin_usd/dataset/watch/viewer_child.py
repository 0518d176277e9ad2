"""A child that views pictures, kept warm between them; one that dies is replaced."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from spin_usd.dataset.process.child import Child, ChildDiedError
from spin_usd.dataset.process.child_limits import START_PATIENCE_S, rendering_memory
from spin_usd.dataset.process.open_renderer import renderer_entry
from spin_usd.scene.effort import Effort

VIEWING_MODULE = "spin_usd.dataset.watch.in_child"  # named as text: it loads USD


class ViewerChild:
    """A child with one renderer. It is started at once."""

    def __init__(self, renderer: str, effort: Effort) -> None:
        self._renderer, self._effort = renderer, effort
        self._start()

    def view(self, arguments: Mapping[str, Any], *, labels: bool, within_s: float) -> dict[str, Any]:
        """Return what `Viewer.view` does, within so many seconds. Raises ChildDiedError where the child ended; the next
        call has another."""
        try:
            opened: dict[str, Any] = {"renderer": self._renderer, "effort": asdict(self._effort)}
            self._child.call("open_viewer", within_s=START_PATIENCE_S, **opened)
            answer: dict[str, Any] = self._child.call("view", within_s=within_s, **arguments, labels=labels)
        except ChildDiedError:
            self.replace()
            raise
        return answer

    def replace(self) -> None:
        """End the child at once, and start another."""
        self._child.kill()
        self._start()

    def interrupt(self) -> None:
        """End the child, from another thread than that which waits for it: its `view` raises ChildDiedError."""
        self._child.interrupt()

    def close(self) -> None:
        """End the child at once."""
        self._child.kill()

    def _start(self) -> None:
        module = renderer_entry(self._renderer).module
        self._child = Child(memory=rendering_memory(), modules=(VIEWING_MODULE, module))

"""The renders after the preview: one at a time in a thread of their own, the older one cancelled for a newer."""

import time
from base64 import b64decode
from collections.abc import Callable
from threading import Condition, Thread
from types import TracebackType
from typing import Any, Self

from spin_usd.commands.watch.request import WatchedPicture, WatchRequest
from spin_usd.commands.watch.state import SharedState, ViewerChild
from spin_usd.errors import SpinError
from spin_usd.picture.make_picture import IMAGE
from spin_usd.processes.child import ChildInternalError
from spin_usd.processes.child_limits import RENDER_PATIENCE_S


class LightRender:
    """Renders the picture that was last asked for, and posts it to the shared state."""

    def __init__(self, request: WatchRequest, shared: SharedState, tell: Callable[[str], None]) -> None:
        self._request, self._shared, self._tell = request, shared, tell
        self._child = ViewerChild(request.renderer, request.effort)
        self._changed = Condition()
        self._wanted: tuple[WatchedPicture, float] | None = None
        self._busy = self._cancelled = self._ended = False
        self._defect: Exception | None = None
        self._thread = Thread(target=self._run, name="light render")

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._child.interrupt()
        self._thread.join()
        self._child.end()

    def render(self, choice: WatchedPicture, edited: float) -> None:
        """Render the picture, edited at that time of time.monotonic, instead of any other."""
        self.cancel()
        with self._changed:
            self._wanted = choice, edited
            self._changed.notify()

    def cancel(self) -> None:
        """Render nothing more of what was asked for."""
        with self._changed:
            self._wanted = None
            if self._busy and not self._cancelled:
                self._cancelled = True
                self._child.interrupt()

    def raise_defect(self) -> None:
        """Raise here what ended the thread before its time, if anything did."""
        if self._defect is not None:
            raise self._defect

    def _run(self) -> None:
        try:
            self._render_all()
        except Exception as defect:
            self._defect = defect
            self._shared.post(rendering=False)

    def _render_all(self) -> None:
        while (wanted := self._next()) is not None:
            choice, edited = wanted
            answer = self._view(choice)
            with self._changed:
                self._busy = False
                if self._cancelled:
                    self._child.replace()  # it may have answered, and been interrupted then
                elif not self._ended:
                    self._post(answer, time.monotonic() - edited)

    def _view(self, choice: WatchedPicture) -> dict[str, Any]:
        """Return what the child sees, or a fault."""
        try:
            return self._child.view(self._request.of(choice), labels=False, within_s=RENDER_PATIENCE_S)
        except (SpinError, ChildInternalError) as fault:
            return {"fault": str(fault)}

    def _next(self) -> tuple[WatchedPicture, float] | None:
        """Wait for what is to be rendered; None at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._wanted is not None or self._ended)
            wanted, self._wanted = self._wanted, None
            self._busy, self._cancelled = True, False
            return None if self._ended else wanted

    def _post(self, answer: dict[str, Any], seconds: float) -> None:
        if "fault" in answer:
            self._shared.post(rendering=False, notes=(f"{self._request.renderer}: {answer['fault']}",))
            self._tell(f"{self._request.renderer}: {answer['fault']}")
            return
        image = b64decode(answer["pictures"][IMAGE])
        self._shared.post(rendering=False, light=self._request.renderer, seconds=seconds, pictures={IMAGE: image})
        self._tell(f"{answer['frame']}: the picture by {self._request.renderer} after {seconds:.2f} s")

"""`spin-usd watch`: watches a stage's files, and shows the result of each edit.

Renders after the preview are made one at a time in a thread of their own, the older one cancelled for a newer.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Condition, Thread
from types import TracebackType
from typing import Self

import numpy as np

from spin_usd.basics.stop_signals import Stopped
from spin_usd.commands.watch.page_server import page_server
from spin_usd.commands.watch.request import (
    VIEW_STAGE,
    FileStates,
    SeenPicture,
    StageView,
    WatchedPicture,
    WatchRequest,
    states_of,
)
from spin_usd.commands.watch.state import FAULTY, READING, SHOWN, SharedState, viewer
from spin_usd.errors import SpinError, UnknownPictureError
from spin_usd.files.new_file import write_whole
from spin_usd.formats.image_file import read_image
from spin_usd.labels.preview import reduced
from spin_usd.picture.kinds import IMAGE
from spin_usd.processes.child import ChildInternalError
from spin_usd.processes.child_limits import RENDER_PATIENCE_S
from spin_usd.processes.deaths import ONCE, ChildDiedError
from spin_usd.processes.open_renderer import ANOTHER_RENDERER, require_renderer
from spin_usd.processes.task import Task
from spin_usd.scene.effort import Effort

PREVIEW = "raycast"
LOOK_S, SETTLE_S, MAX_SETTLE_S = 0.1, 0.03, 0.5
SHARE = 20  # checks of the files take at most this part of the time
UPPER_HALF, RESET = "\u2580", "\x1b[0m"


def watch(request: WatchRequest, *, tell: Callable[[str], None], on_image: Callable[[bytes], None]) -> None:
    """Serve the page until a signal stops it. `tell` takes lines for the user, `on_image` each new image (PNG). Raises
    InputError where the page cannot be served or the stage has no such picture, UnsupportedError without the
    renderer."""
    require_renderer(request.renderer, instead=ANOTHER_RENDERER)
    shared = SharedState(request.choice, on_image)
    with suppress(Stopped), ExitStack() as stack:
        stack.callback(shared.close)
        tell(f"{stack.enter_context(page_server(shared, request.options.port))}   (open it in a browser; Ctrl-C ends)")
        follow = Follower(request, shared, tell)
        stack.callback(follow.close)
        if request.renderer != PREVIEW:
            follow.light = stack.enter_context(LightRender(request, shared, tell))
        follow.show(shared.choice, first=True)
        while True:
            follow.wait()
            follow.show(shared.choice)


class LightRender:
    """Renders the picture that was requested last, and posts it to the shared state."""

    def __init__(self, request: WatchRequest, shared: SharedState, tell: Callable[[str], None]) -> None:
        self._request, self._shared, self._tell = request, shared, tell
        self._viewer = viewer(request.renderer, request.effort)
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
        self._viewer.interrupt()
        self._thread.join()
        self._viewer.close()

    def render(self, choice: WatchedPicture, edited: float) -> None:
        """Render the picture, edited at that time of time.monotonic, instead of any other."""
        self.cancel()
        with self._changed:
            self._wanted = choice, edited
            self._changed.notify()

    def cancel(self) -> None:
        """Drop the requested pictures."""
        with self._changed:
            self._wanted = None
            if self._busy and not self._cancelled:
                self._cancelled = True
                self._viewer.interrupt()

    def raise_defect(self) -> None:
        """Raise here the error that ended the thread early, if any."""
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
            view = self._view(choice)
            with self._changed:
                self._busy = False
                if self._cancelled:
                    self._viewer.restart()  # it may have been interrupted after its answer
                elif not self._ended:
                    self._post(view, time.monotonic() - edited)

    def _view(self, choice: WatchedPicture) -> StageView:
        """Return the child's view, or a fault."""
        try:
            request = self._request.of(choice, labels=False)
            task = Task(call=VIEW_STAGE, request=request, within_s=RENDER_PATIENCE_S, tries=ONCE)
            return self._viewer.result(self._viewer.submit(task))
        except (SpinError, ChildInternalError) as fault:
            return StageView(fault=str(fault))

    def _next(self) -> tuple[WatchedPicture, float] | None:
        """Wait for a picture to render; None at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._wanted is not None or self._ended)
            wanted, self._wanted = self._wanted, None
            self._busy, self._cancelled = True, False
            return None if self._ended else wanted

    def _post(self, view: StageView, seconds: float) -> None:
        if view.seen is None:
            self._shared.post(rendering=False, notes=(f"{self._request.renderer}: {view.fault}",))
            self._tell(f"{self._request.renderer}: {view.fault}")
            return
        image = view.seen.pictures[IMAGE]
        self._shared.post(rendering=False, light=self._request.renderer, seconds=seconds, pictures={IMAGE: image})
        self._tell(f"{view.seen.frame}: the picture by {self._request.renderer} after {seconds:.2f} s")


class Follower:
    """Shows the stage as it is, and waits until it changes."""

    light: LightRender | None = None

    def __init__(self, request: WatchRequest, shared: SharedState, tell: Callable[[str], None]) -> None:
        self._request, self._shared, self._tell = request, shared, tell
        self._viewer = viewer(PREVIEW, Effort(samples=1))
        self._shown = request.choice
        self._files: FileStates = {str(request.stage.absolute()): None}

    def close(self) -> None:
        """End the child."""
        self._viewer.close()

    def show(self, choice: WatchedPicture, *, first: bool = False) -> None:
        """Read the stage, and post its view. Raises UnknownPictureError for a `first` choice that the stage does not
        have; a later one may exist again after an edit."""
        edited = time.monotonic()
        if self.light is not None:
            self.light.cancel()
        self._shared.post(status=READING, rendering=False)
        self._shown, known = choice, states_of(self._files)
        view = self._view(choice)
        if first and view.unknown:
            raise UnknownPictureError(view.fault)
        if view.seen is None:
            self._files = {**known, **view.files}
            self._shared.post(status=FAULTY, message=view.fault)
            self._tell(view.fault)
        else:
            self._files = view.files
            self._post(choice, view.seen, time.monotonic() - edited)
            if self.light is not None:
                self.light.render(choice, edited)

    def wait(self) -> None:
        """Wait for another choice, or for an edit and the end of its writing."""
        while self._shared.choice == self._shown:
            began = time.monotonic()
            if self.light is not None:
                self.light.raise_defect()
            if (now := states_of(self._files)) != self._files:
                self._settle(now)
                return
            self._shared.wait_for_choice(self._shown, max(LOOK_S, SHARE * (time.monotonic() - began)))

    def _settle(self, now: FileStates) -> None:
        until = time.monotonic() + MAX_SETTLE_S
        while time.monotonic() < until:
            time.sleep(SETTLE_S)
            before, now = now, states_of(self._files)
            if now == before and not any(state and state[1] == 0 for state in now.values()):
                return

    def _view(self, choice: WatchedPicture) -> StageView:
        """Return a child's view, from a second child if the first dies: the cause may not be the stage."""
        try:
            return self._viewer.call(VIEW_STAGE, self._request.of(choice, labels=True))
        except ChildDiedError as died:
            return StageView(fault=died.found)
        except ChildInternalError as fault:
            return StageView(fault=str(fault))

    def _post(self, choice: WatchedPicture, seen: SeenPicture, seconds: float) -> None:
        self._shared.post(
            status=SHOWN,
            message="",
            frame=seen.frame,
            place=seen.place,
            frames=seen.frames,
            variant=choice.variant,
            variants=seen.variants,
            notes=seen.notes,
            light=PREVIEW,
            rendering=self.light is not None,
            seconds=seconds,
            pictures=seen.pictures,
        )
        self._tell(f"{seen.frame} of {choice.variant}: labels and preview after {seconds:.2f} s")


def half_blocks(png: bytes, columns: int) -> Iterator[str]:
    """Yield the lines that show the picture (PNG, RGB) in that number of columns, in 24-bit colours (ISO 8613-6)."""
    with TemporaryDirectory(prefix="spin_usd-") as folder:
        file = Path(folder, "picture.png")
        write_whole(file, png)
        pixels = reduced(read_image(file)[0], columns)
    even = np.pad(pixels, ((0, len(pixels) % 2), (0, 0), (0, 0)))
    for upper, lower in zip(even[::2].tolist(), even[1::2].tolist(), strict=True):
        pairs = zip(upper, lower, strict=True)
        yield "".join(f"\x1b[38;2;{_code(above)};48;2;{_code(below)}m{UPPER_HALF}" for above, below in pairs) + RESET


def _code(colour: list[int]) -> str:
    return ";".join(map(str, colour))

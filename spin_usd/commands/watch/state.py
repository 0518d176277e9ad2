"""State shown by page and terminal: written by threads that make pictures, read by threads that wait for them."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from threading import Condition
from typing import Any

from spin_usd.commands.watch.request import OPEN_VIEWER, OpenViewer, WatchedPicture
from spin_usd.picture.kinds import IMAGE
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import rendering_memory
from spin_usd.processes.executor import Executor
from spin_usd.processes.open_renderer import renderer_entry
from spin_usd.scene.effort import Effort

READING, SHOWN, FAULTY = "reading", "shown", "faulty"


@dataclass(frozen=True, kw_only=True)
class State:
    """The state at one time."""

    status: str = READING
    """READING after an edit, SHOWN, or FAULTY."""
    message: str = ""
    """Fault, while the last good pictures stay."""
    frame: str = ""
    place: int = 0
    frames: int = 0
    variant: str = ""
    variants: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    light: str = ""
    """Name of the renderer that made the image."""
    rendering: bool = False
    """Whether another renderer is at work on it."""
    pictures: tuple[tuple[str, int], ...] = ()
    """Times of making, by kind; other numbers are other pictures."""
    seconds: float = 0.0
    """Seconds from the notice of the edit to the picture."""


class SharedState:
    """The state, the pictures and the choice of what to show, for several threads."""

    def __init__(self, choice: WatchedPicture, on_image: Callable[[bytes], None] = lambda png: None) -> None:
        """`on_image` is called with each new image (PNG), in the thread that posts it."""
        self._on_image = on_image
        self._changed = Condition()
        self._state, self._version = State(), 0
        self._pictures: dict[str, bytes] = {}
        self._choice, self._closed = choice, False

    @property
    def choice(self) -> WatchedPicture:
        """The picture to show."""
        with self._changed:
            return self._choice

    @property
    def closed(self) -> bool:
        """Whether the command has ended."""
        return self._closed

    def choose(self, choice: WatchedPicture) -> None:
        """Choose another picture to show."""
        with self._changed:
            self._choice = choice
            self._changed.notify_all()

    def wait_for_choice(self, other_than: WatchedPicture, within_s: float) -> None:
        """Wait until the choice changes, but no longer than that."""
        with self._changed:
            self._changed.wait_for(lambda: self._choice != other_than or self._closed, timeout=within_s)

    def post(self, *, pictures: dict[str, bytes] | None = None, **state: Any) -> None:
        """Post state by the names of State, and pictures (PNG) by their kinds."""
        with self._changed:
            self._version += 1
            made = dict(self._state.pictures) | dict.fromkeys(pictures or {}, self._version)
            self._pictures |= pictures or {}
            self._state = replace(self._state, **state, pictures=tuple(made.items()))
            self._changed.notify_all()
        if pictures and IMAGE in pictures:
            self._on_image(pictures[IMAGE])

    def state_after(self, version: int, within_s: float) -> tuple[int, dict[str, Any] | None]:
        """Wait for a state later than `version`; return its version, and the state as JSON, None if none came."""
        with self._changed:
            self._changed.wait_for(lambda: self._version > version or self._closed, timeout=within_s)
            if self._version <= version:
                return version, None
            return self._version, {**asdict(self._state), "pictures": dict(self._state.pictures)}

    def picture(self, kind: str) -> bytes | None:
        """Return the last picture of that kind (PNG)."""
        with self._changed:
            return self._pictures.get(kind)

    def close(self) -> None:
        """Wake all waiting threads."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()


def viewer(renderer: str, effort: Effort) -> Executor[None]:
    """Return an executor of one child with that renderer, which is started at once."""

    def start(_: int) -> Child:
        child = Child(memory=rendering_memory(), modules=(OPEN_VIEWER.module, renderer_entry(renderer).module))
        child.send(OPEN_VIEWER, OpenViewer(renderer=renderer, effort=effort))
        return child

    executor = Executor(start, opening=OPEN_VIEWER)
    executor.start()
    return executor

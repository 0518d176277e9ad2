"""Edits of a target's keypoints: the state of the tool, kept outside the browser."""

import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.keypoints.edits import added, deleted, free_name, moved, next_name, renamed
from spin_usd.commands.keypoints.shown_target import Pick, ShownTarget
from spin_usd.commands.keypoints.suggestions import SuggestionMethod, suggest
from spin_usd.errors import InputError, SpinError
from spin_usd.geometry.frames import symmetric
from spin_usd.geometry.snapping import Snap
from spin_usd.scene.keypoints import Keypoints

NEAR = 0.009  # radians beside a marker that a click still means: some six pixels
NONE = Keypoints(names=(), points=np.zeros((0, 3)))
State = TypeVar("State")


@dataclass(frozen=True, kw_only=True)
class Status:
    """The last message to the user, and whether it is a refusal."""

    text: str
    refused: bool = False


class Session:
    """The keypoints with their history, the selected one, and the point that is being picked.

    Every change is saved by `save` at once; if that fails, `unsaved` is the reason, and the next change tries again.
    Callers on other threads hold `lock`. `on_change` is called after each call that may have changed something.
    """

    def __init__(
        self, target: ShownTarget, keypoints: Keypoints, save: Callable[[Keypoints], None], where: str
    ) -> None:
        """`where`: the file of `save`, for people."""
        self.lock = threading.RLock()
        self.target = target
        self.history = History(keypoints)
        self.snap = Snap.VERTEX
        self.pick: Pick | None = None
        self.selected: str | None = keypoints.names[0] if keypoints.names else None
        self.suggested: Float = NONE.points
        self.status = Status(text="Click on the target to pick a point.")
        self.saved_in = where
        self.unsaved: str | None = None
        self.on_change: Callable[[], None] = lambda: None
        self._save = save

    @property
    def keypoints(self) -> Keypoints:
        """The current keypoints."""
        return self.history.now

    @property
    def preview(self) -> Float | None:
        """Where the point that is being picked would go (3,), body axes, metres; None without one."""
        return self.pick.places[self.snap] if self.pick else None

    def do(self, action: Callable[[], str | None]) -> None:
        """Do `action`, one of the methods below; show its result or its refusal as the message. An internal error is
        shown too, and raised."""
        with self.lock:
            try:
                self._do(action)
            except Exception as defect:
                self.status = Status(text=f"an internal error: {defect}", refused=True)
                raise
            finally:
                self.on_change()

    def click(self, origin: Float, direction: Float) -> str:
        """Take a click whose ray starts at `origin` (3,) along the unit `direction` (3,), body axes, metres: select
        the keypoint that it means, or pick the suggestion or the surface point that it meets."""
        self.pick = self.target.pick(origin, direction)
        end = self.target.behind(origin, self.pick)
        if (number := _meant(self.keypoints.points, origin, direction, end)) is not None:
            return self.select(self.keypoints.names[number])
        if (number := _meant(self.suggested, origin, direction, end)) is not None:
            self.pick = Pick.at(self.suggested[number])
            return "A suggestion is picked."
        return "A point is picked." if self.pick else "That click met nothing: click on the target."

    def select(self, name: str) -> str:
        """Select the keypoint of that name."""
        self.selected, self.pick = name, None
        return f"{name} is selected."

    def add(self, name: str) -> str:
        """Add the picked point as a keypoint of that name. Raises InputError without one, or for the name."""
        self.history.change(added(self.keypoints, name, self._picked()))
        self.selected, self.pick = name, None
        return f"{name} is added."

    def move_selected(self) -> str:
        """Move the selected keypoint to the picked point. Raises InputError without either."""
        name, point = self._selection(), self._picked()
        self.history.change(moved(self.keypoints, name, point))
        self.pick = None
        return f"{name} is moved."

    def change_selected(self, name: str, point: Float) -> str:
        """Give the selected keypoint that name and place (3,). Raises InputError without one, or for the name."""
        old = self._selection()
        self.history.change(moved(renamed(self.keypoints, old, name), name, point))
        self.selected = name
        return f"{name} is changed."

    def delete_selected(self) -> str:
        """Delete the selected keypoint. Raises InputError without one."""
        name = self._selection()
        place = self.keypoints.names.index(name)
        self.history.change(deleted(self.keypoints, name))
        left = self.keypoints.names
        self.selected = left[min(place, len(left) - 1)] if left else None
        return f"{name} is deleted."

    def delete_all(self) -> str:
        """Delete all keypoints."""
        self.history.change(NONE)
        self.selected = None
        return "All keypoints are deleted; undo brings them back."

    def copy_selected(self, symmetry: str) -> str:
        """Add a keypoint where `symmetry`, one of SYMMETRIES, takes the selected one. Raises InputError without
        one."""
        name = self._selection()
        place = self.keypoints.points[self.keypoints.names.index(name)]
        copy = free_name(self.keypoints, name)
        self.history.change(added(self.keypoints, copy, symmetric(place, symmetry)))
        self.selected = copy
        return f"{copy} is added: {name}, {symmetry}."

    def suggest(self, method: SuggestionMethod, count: int, seed: int) -> str:
        """Show up to `count` suggestions."""
        self.suggested = suggest(self.target, method, count, seed)
        return f"{pluralise(len(self.suggested), 'suggestion')}: click on one to pick it, or add all."

    def forget_suggestions(self) -> str:
        """Show no suggestions any more."""
        self.suggested = NONE.points
        return "No suggestions are shown."

    def add_suggestions(self) -> str:
        """Add all suggestions as keypoints, and show them no more."""
        keypoints = self.keypoints
        for point in self.suggested:
            keypoints = added(keypoints, next_name(keypoints), point)
        if keypoints is not self.keypoints:
            self.history.change(keypoints)
        count, self.suggested = len(self.suggested), NONE.points
        return f"{pluralise(count, 'keypoint')} added."

    def undo(self) -> str:
        """Take the last change back."""
        return self._go(self.history.undo, self.history.can_undo, "undo")

    def redo(self) -> str:
        """Redo the last undone action."""
        return self._go(self.history.redo, self.history.can_redo, "redo")

    def save(self) -> None:
        """Save the keypoints. Raises the file's error if that fails; `unsaved` is the reason."""
        self.unsaved = "the last change was not saved"
        try:
            self._save(self.keypoints)
            self.unsaved = None
        except SpinError as failed:
            self.unsaved = str(failed)
            raise

    def _do(self, action: Callable[[], str | None]) -> None:
        before = self.keypoints
        try:
            text = action()
            self.status = self.status if text is None else Status(text=text)
        except SpinError as refused:
            self.status = Status(text=str(refused), refused=True)
        if self.keypoints is not before:
            with suppress(SpinError):
                self.save()

    def _go(self, go: Callable[[], None], possible: bool, word: str) -> str:
        if not possible:
            return f"There is nothing to {word}."
        go()
        if self.selected not in self.keypoints.names:
            self.selected = self.keypoints.names[-1] if self.keypoints.names else None
        return "Undone." if word == "undo" else "Done again."

    def _picked(self) -> Float:
        point = self.preview
        if point is None:
            raise InputError("no point is picked", do="click on the target first")
        return point

    def _selection(self) -> str:
        if self.selected is None:
            raise InputError("no keypoint is selected", do="click on one, or choose it in the list")
        return self.selected


def _meant(points: Float, origin: Float, direction: Float, end: float) -> int | None:
    """Return the number of the point of `points` (N, 3) that a ray passes within the angle NEAR, the nearest to its
    origin of several, and no farther than `end`; None for none."""
    towards = points - origin
    distance = np.linalg.norm(towards, axis=1)
    angle = np.arctan2(np.linalg.norm(np.cross(towards, direction), axis=1), towards @ direction)
    meant = np.flatnonzero((angle <= NEAR) & (distance <= end))
    return int(meant[np.argmin(distance[meant])]) if len(meant) else None


class History(Generic[State]):
    """A state that never changes itself but is replaced, and those before and after it."""

    def __init__(self, first: State) -> None:
        self._states = [first]
        self._place = 0

    @property
    def now(self) -> State:
        """The present state."""
        return self._states[self._place]

    @property
    def can_undo(self) -> bool:
        """Whether there is a state before."""
        return self._place > 0

    @property
    def can_redo(self) -> bool:
        """Whether there is a state that was undone."""
        return self._place + 1 < len(self._states)

    def change(self, state: State) -> None:
        """Add `state` to the history; undone states are dropped."""
        self._states[self._place + 1 :] = [state]
        self._place += 1

    def undo(self) -> None:
        """Go back to the state before, if there is one."""
        self._place -= self.can_undo

    def redo(self) -> None:
        """Go on to the state that was undone last, if there is one."""
        self._place += self.can_redo

"""The states of what is edited, to be undone and redone."""

from typing import Generic, TypeVar

State = TypeVar("State")


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
        """Let `state` follow the present one; what was undone is gone."""
        self._states[self._place + 1 :] = [state]
        self._place += 1

    def undo(self) -> None:
        """Go back to the state before, if there is one."""
        self._place -= self.can_undo

    def redo(self) -> None:
        """Go on to the state that was undone last, if there is one."""
        self._place += self.can_redo

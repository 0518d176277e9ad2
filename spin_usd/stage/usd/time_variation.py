"""Find which values of a stage can change in time, so that all others are read once."""

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable
from typing import Any, Generic, TypeVar

from pxr import Sdf, Usd

from spin_usd.basics.identity_memo import IdentityMemo
from spin_usd.stage.usd.visibility import ancestors

POSE = ("xformOp:", "spin:motion:")
T = TypeVar("T")


class CachedIfConstant(Generic[T]):
    """A value in time, given by `read`: read again only where it `varies` and the time, or the stage, has changed."""

    _edits = 0

    def __init__(self, varies: bool, read: Callable[[Usd.TimeCode], T]) -> None:
        self.varies, self._read = varies, read
        self._last: tuple[tuple[Usd.TimeCode, int], T] | None = None

    def at(self, time: Usd.TimeCode) -> T:
        """Return the value at `time`."""
        now = time, CachedIfConstant._edits
        if self._last is None or (self.varies and now != self._last[0]):
            self._last = now, self._read(time)
        return self._last[1]

    @staticmethod
    def forget() -> None:
        """Let all that varies be read again: a stage was edited."""
        CachedIfConstant._edits += 1


class CameraSpaceCache:
    """Values of prims in camera axes, kept while neither the prim nor the camera moves or changes. all_still: whether
    none of the prims ever moves or changes."""

    def __init__(self, prims: Iterable[Usd.Prim]) -> None:
        found = list(prims)
        self._still = {prim.GetPath() for prim in found if not (has_varying_attribute(prim) or _hides_or_moves(prim))}
        self.all_still = len(self._still) == len(found)
        self._values: defaultdict[Sdf.Path, IdentityMemo[Any]] = defaultdict(IdentityMemo)
        self._tuples: defaultdict[Hashable, IdentityMemo[Any]] = defaultdict(IdentityMemo)

    def read(self, prim: Usd.Prim, camera: object, read: Callable[[], T]) -> T:
        """Return the value that `read` gives for `prim`; the last one again where the prim does not vary and `camera`,
        the camera's pose, is the same object."""
        path = prim.GetPath()
        value: T = self._values[path].of((camera,), read) if path in self._still else read()
        return value

    def same_tuple(self, name: Hashable, values: tuple[T, ...]) -> tuple[T, ...]:
        """Return `values`; where the last tuple of this name holds the same objects, that very tuple."""
        same: tuple[T, ...] = self._tuples[name].of(values, lambda: values)
        return same


def stated_attributes(prim: Usd.Prim) -> list[Usd.Attribute]:
    """List the attributes of `prim` that may have a value of its own, from a layer or from value clips: USD's own list
    of authored attributes leaves out a schema's attribute to which only clips give a value."""
    clips = any(each.HasAuthoredMetadata("clips") for each in (*ancestors(prim), prim))
    return list(prim.GetAttributes() if clips else prim.GetAuthoredAttributes())


def varying(prim: Usd.Prim) -> frozenset[str]:
    """Return the names of the attributes of `prim`, except its own pose, that can change in time."""
    attributes = (a for a in stated_attributes(prim) if not a.GetName().startswith(POSE))
    return frozenset(a.GetName() for a in attributes if a.ValueMightBeTimeVarying())


def moves(prim: Usd.Prim) -> bool:
    """Return whether the pose of `prim` in the world can change in time."""
    chain = (*ancestors(prim), prim)
    poses = (a for p in chain for a in p.GetAuthoredAttributes() if a.GetName().startswith(POSE))
    return any(a.ValueMightBeTimeVarying() for a in poses)


def _hides_or_moves(prim: Usd.Prim) -> bool:
    """Return whether an ancestor of `prim` can hide or move it in time."""
    return moves(prim) or any(visibility_varies(above) for above in ancestors(prim))


def has_varying_attribute(prim: Usd.Prim) -> bool:
    """Return whether any attribute of `prim` can change in time."""
    return any(attribute.ValueMightBeTimeVarying() for attribute in stated_attributes(prim))


def visibility_varies(prim: Usd.Prim) -> bool:
    """Return whether the visibility of `prim` can change in time."""
    visibility = prim.GetAttribute("visibility")
    return bool(visibility) and bool(visibility.ValueMightBeTimeVarying())

"""What of a stage can change in time, so that the rest is read once."""

from collections.abc import Callable, Hashable, Iterable
from typing import Generic, TypeVar

from pxr import Sdf, Usd

from spin_usd.stage.usd.visibility import ancestors

POSE = "xformOp:"
T = TypeVar("T")


class CachedIfConstant(Generic[T]):
    """What `read` gives at a time, read again only where it `varies` and the time is another."""

    def __init__(self, varies: bool, read: Callable[[Usd.TimeCode], T]) -> None:
        self.varies, self._read = varies, read
        self._known: tuple[Usd.TimeCode, T] | None = None

    def at(self, time: Usd.TimeCode) -> T:
        if self._known is None or (self.varies and time != self._known[0]):
            self._known = time, self._read(time)
        return self._known[1]


class CameraSpaceCache:
    """Values read off prims in camera axes, kept while neither the prim nor the camera moves or changes. all_still:
    whether none of the prims ever does."""

    def __init__(self, prims: Iterable[Usd.Prim]) -> None:
        found = list(prims)
        self._still = {prim.GetPath() for prim in found if not (any_varies(prim) or _hides_or_moves(prim))}
        self.all_still = len(self._still) == len(found)
        self._values: dict[Sdf.Path, tuple[object, object]] = {}
        self._tuples: dict[Hashable, tuple[object, ...]] = {}

    def read(self, prim: Usd.Prim, camera: object, read: Callable[[], T]) -> T:
        """What `read` gives of `prim`; the last time's again where the prim does not vary and `camera`, which says
        where the camera stands, is the same object."""
        path = prim.GetPath()
        if path not in self._still:
            return read()
        last = self._values.get(path)
        if last is None or last[0] is not camera:
            last = self._values[path] = camera, read()
        return last[1]  # type: ignore[return-value]

    def same_tuple(self, name: Hashable, values: tuple[T, ...]) -> tuple[T, ...]:
        """`values`, as the very tuple that was given by this name last where it holds the same objects."""
        last = self._tuples.get(name)
        if last is None or len(last) != len(values) or any(a is not b for a, b in zip(last, values, strict=True)):
            last = self._tuples[name] = values
        return last  # type: ignore[return-value]


def varying(prim: Usd.Prim) -> frozenset[str]:
    """The names of the attributes of `prim`, but its own pose, that can change in time."""
    attributes = (a for a in prim.GetAuthoredAttributes() if not a.GetName().startswith(POSE))
    return frozenset(a.GetName() for a in attributes if a.ValueMightBeTimeVarying())


def moves(prim: Usd.Prim) -> bool:
    """Whether where `prim` stands in the world can change in time."""
    chain = (*ancestors(prim), prim)
    poses = (a for p in chain for a in p.GetAuthoredAttributes() if a.GetName().startswith(POSE))
    return any(a.ValueMightBeTimeVarying() for a in poses)


def _hides_or_moves(prim: Usd.Prim) -> bool:
    """Whether what is above `prim` can hide or move it in time."""
    return moves(prim) or any(visibility_varies(above) for above in ancestors(prim))


def any_varies(prim: Usd.Prim) -> bool:
    return any(attribute.ValueMightBeTimeVarying() for attribute in prim.GetAuthoredAttributes())


def visibility_varies(prim: Usd.Prim) -> bool:
    visibility = prim.GetAttribute("visibility")
    return bool(visibility) and bool(visibility.ValueMightBeTimeVarying())

"""Poses that the variants of a stage share: unchanged poses are computed once for all variants."""

from collections.abc import Callable, Iterable

from pxr import Usd, UsdGeom

from spin_usd.geometry.transform import Transform
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.time_variation import POSE
from spin_usd.stage.usd.visibility import ancestors

TRANSFORM = (*POSE, "xformOpOrder", schema.CAPTURE_TIME)
Placed = tuple[Transform, float]
"""T_cam_body, and the scale of the body's axes in the world."""


class SharedPoses:
    """The poses of a body by time code, which variants share whose opinions on them are the same."""

    def __init__(self) -> None:
        self._sources: tuple[str, ...] | None = None
        self._known: dict[float, Placed] = {}

    def of(self, camera: Usd.Prim, body: Usd.Prim) -> "SharedPoses | None":
        """Return these where the same opinions decide the poses of both prims as of those before, new ones where others
        do; None where values come from clips, whose opinions are not looked into."""
        clock = body.GetStage().GetDefaultPrim()
        chain = {prim.GetPath(): prim for each in (camera, body) for prim in (*ancestors(each), each)}
        chain |= {clock.GetPath(): clock} if clock else {}
        if any(prim.HasAuthoredMetadata("clips") for prim in chain.values()):
            return None
        sources = tuple(source for _, prim in sorted(chain.items()) for source in _sources(prim))
        if self._sources not in (None, sources):
            return SharedPoses().of(camera, body)
        self._sources = sources
        return self

    def at(self, time: Usd.TimeCode, compute: Callable[[], Placed]) -> Placed:
        """Return the pose at that time, computed where it is not known yet."""
        code = time.GetValue()
        if code not in self._known:
            self._known[code] = compute()
        return self._known[code]


def _sources(prim: Usd.Prim) -> Iterable[str]:
    """Yield the inputs of the transform of `prim` in time: its opinions, strongest first, and the time offsets of their
    layers."""
    yield str(prim.GetPath())
    yield str(UsdGeom.Xformable(prim).GetResetXformStack() if prim.IsA(UsdGeom.Xformable) else None)
    for attribute in prim.GetAuthoredAttributes():
        if attribute.GetName().startswith(TRANSFORM):
            for spec, offset in attribute.GetPropertyStackWithLayerOffsets(Usd.TimeCode.Default()):
                yield f"{spec.layer.identifier} {spec.path} {offset.offset} {offset.scale}"

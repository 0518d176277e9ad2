"""Find which prims of a stage are visible: visibility and purpose, own and inherited."""

from pxr import Usd, UsdGeom

from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.values import read, read_any

PROXIES = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
RENDERED_PURPOSES = ("default", "render")
"""Purposes that are rendered; proxy, guide, and names that USD does not know are not."""


def is_invisible(prim: Usd.Prim, time: Usd.TimeCode) -> bool:
    """Return whether `prim` itself hides all at and below it, at `time`."""
    visibility = prim.IsA(UsdGeom.Imageable) and UsdGeom.Imageable(prim).GetVisibilityAttr()
    value = read_any(visibility, time) if visibility else None
    if not isinstance(value, str | None):
        read(visibility, time)  # raises StageError over its type
    return bool(value == UsdGeom.Tokens.invisible)


def note_unknown_visibility(prim: Usd.Prim, time: Usd.TimeCode, notes: Notes) -> None:
    """Note a visibility that USD does not know, which hides nothing."""
    visibility = prim.IsA(UsdGeom.Imageable) and UsdGeom.Imageable(prim).GetVisibilityAttr()
    value = read_any(visibility, time) if visibility else None
    if value not in (None, UsdGeom.Tokens.inherited, UsdGeom.Tokens.invisible):
        notes.add("visibility-unknown", visibility.GetPath(), f"is {value!r}, which USD does not know: it is shown")


def is_always_invisible(prim: Usd.Prim) -> bool:
    """Return whether `prim` itself hides all at and below it at all times."""
    if not is_invisible(prim, Usd.TimeCode.EarliestTime()):
        return False
    return not UsdGeom.Imageable(prim).GetVisibilityAttr().ValueMightBeTimeVarying()


def own_purpose(prim: Usd.Prim, inherited: str) -> str:
    """Return the purpose of `prim`, whose parent has `inherited`: an authored one wins, known to USD or not."""
    purpose = prim.IsA(UsdGeom.Imageable) and UsdGeom.Imageable(prim).GetPurposeAttr()
    return str(read_any(purpose)) if purpose and purpose.HasAuthoredValue() else inherited


def purpose_of(prim: Usd.Prim) -> str:
    """Return the purpose that `prim` has or inherits."""
    purpose = "default"
    for each in (*ancestors(prim), prim):
        purpose = own_purpose(each, purpose)
    return purpose


def ancestors(prim: Usd.Prim) -> list[Usd.Prim]:
    """List all prims above `prim`, from the root down."""
    found: list[Usd.Prim] = []
    while prim.GetParent() and not prim.GetParent().IsPseudoRoot():
        prim = prim.GetParent()
        found.insert(0, prim)
    return found


def first_shown(prim: Usd.Prim, wanted: Usd.TimeCode) -> Usd.TimeCode:
    """Return the `wanted` time, or else the first time sample, at which no visibility hides `prim`; the wanted one if
    it is always hidden."""
    chain = [each for each in (*ancestors(prim), prim) if each.IsA(UsdGeom.Imageable)]
    samples = sorted({time for each in chain for time in UsdGeom.Imageable(each).GetVisibilityAttr().GetTimeSamples()})
    times = (wanted, *map(Usd.TimeCode, samples))
    shown = (time for time in times if not any(is_invisible(each, time) for each in chain))
    return next(shown, wanted)

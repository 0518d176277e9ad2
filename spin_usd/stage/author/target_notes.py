"""Notes on the target of a newly written stage, for what its pictures do not show."""

from collections.abc import Iterator

from pxr import Usd, UsdGeom

from spin_usd.scene.model import NOMINAL
from spin_usd.stage.read.frames import read_frames
from spin_usd.stage.read.target.bodies import find_target
from spin_usd.stage.usd.draw_modes import stand_ins
from spin_usd.stage.usd.visibility import PROXIES


def target_notes(stage: Usd.Stage) -> tuple[str, ...]:
    """Return sentences on the target of `stage`: where it moves in time, where other programs show a stand-in, and
    where subdivision makes it smoother than was perhaps meant."""
    target = find_target(stage)
    return (*_motion(stage, target), *_draw_modes(target), *_smoothed(target))


def _motion(stage: Usd.Stage, target: Usd.Prim) -> Iterator[str]:
    samples = [time for prim in _below(target) for ends in _ends(prim) for time in ends]
    if samples:
        first, last = min(samples), max(samples)
        times = [frame.time_code for frame in read_frames(stage, NOMINAL)]
        outside = sum(not first <= time <= last for time in times)
        yield (
            f"the target moves by itself between the stage's time codes {first:g} and {last:g}, where picture i is "
            f"time code i; {outside} of {len(times)} pictures lie outside, and show it as it is at the nearer end"
        )


def _ends(prim: Usd.Prim) -> Iterator[tuple[float, float]]:
    """Yield the first and the last time sample of each attribute that changes."""
    for attribute in prim.GetAuthoredAttributes():
        if attribute.ValueMightBeTimeVarying():
            samples = attribute.GetTimeSamples()
            yield samples[0], samples[-1]


def _draw_modes(target: Usd.Prim) -> Iterator[str]:
    found = list(stand_ins(target))
    if found:
        prim, mode = found[0]
        more = f", as {len(found) - 1} more do" if len(found) > 1 else ""
        yield f"{prim.GetPath()} asks to be shown as {mode}{more}; its geometry is rendered instead"


def _smoothed(target: Usd.Prim) -> Iterator[str]:
    """Note meshes with normals but the default subdivision scheme, catmullClark, which ignores normals."""
    found = [prim for prim in Usd.PrimRange(target, PROXIES) if prim.IsA(UsdGeom.Mesh) and _means_polygons(prim)]
    if found:
        more = f" (as {len(found) - 1} more meshes)" if len(found) > 1 else ""
        yield (
            f"{found[0].GetPath()}{more} has normals and no subdivisionScheme: by USD's default it is subdivided to a "
            "smooth surface, without these normals; author subdivisionScheme = none if polygons are meant"
        )


def _means_polygons(prim: Usd.Prim) -> bool:
    mesh = UsdGeom.Mesh(prim)
    normals = mesh.GetNormalsAttr().HasAuthoredValue() or UsdGeom.PrimvarsAPI(prim).HasPrimvar("normals")
    return bool(normals) and not mesh.GetSubdivisionSchemeAttr().HasAuthoredValue()


def _below(target: Usd.Prim) -> Iterator[Usd.Prim]:
    """Yield all prims below the target. The target's own attributes are left out: they hold the poses of the
    pictures."""
    return (prim for prim in Usd.PrimRange(target, PROXIES) if prim != target)

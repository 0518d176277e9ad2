"""What another library than ours says of a model file: its bounds and its unit of length."""

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

USD = {".usd", ".usda", ".usdc", ".usdz"}
MESHES = {".obj", ".ply", ".stl", ".gltf", ".glb"}
SUFFIXES = USD | MESHES
UNITLESS = {".obj", ".ply", ".stl"}
PLAUSIBLE_M = (0.02, 200.0)  # a craft's largest side, as `spin-usd author` takes it
PATIENCE_S = 60


@dataclass(frozen=True, kw_only=True)
class Source:
    """low, high (3,): corners of the bounds in the file's own axes, metres · units_per_metre: what to tell author, None
    where the file says it itself."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    units_per_metre: float | None


def source_of(file: Path) -> Source:
    """The source's bounds, read in a process of its own, since a file by others may crash its reader.

    Raises ValueError that says why where the library cannot read it.
    """
    command = [sys.executable, __file__, str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    if done.returncode:
        raise ValueError(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else f"exit {done.returncode}")
    found = json.loads(done.stdout.splitlines()[-1])
    scale, units = found["metres_per_unit"], None
    if scale is None:
        units = plausible_units(max(b - a for a, b in zip(*found["bounds"], strict=True)))
        scale = 1 / units
    low, high = (tuple(value * scale for value in corner) for corner in found["bounds"])
    return Source(low=low, high=high, units_per_metre=units)


def plausible_units(size: float) -> float:
    """Units per metre that make `size` a craft's: 1, or the least power of ten that does."""
    units = 1.0
    while size / units > PLAUSIBLE_M[1]:
        units *= 10
    while 0 < size / units < PLAUSIBLE_M[0]:
        units /= 10
    return units


def main() -> None:
    """Print the bounds of the file that is named, in its own units, and how many metres one is, as JSON."""
    file = Path(sys.argv[1])
    print(json.dumps(_of_usd(file) if file.suffix.lower() in USD else _of_mesh(file)))


def _of_usd(file: Path) -> dict[str, object]:
    """The points of every mesh where they come to lie, and of other gprims the corners of their extents: tighter than
    a BBoxCache, which turns boxes."""
    import numpy as np
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(file))
    time = Usd.TimeCode.EarliestTime()
    places = UsdGeom.XformCache(time)
    purposes = [UsdGeom.Tokens.default_, UsdGeom.Tokens.render]
    boxes = UsdGeom.BBoxCache(time, purposes, useExtentsHint=False)
    corners = []
    shown = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract)
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), shown):
        drawn = UsdGeom.Imageable(prim)
        if not prim.IsA(UsdGeom.Boundable) or drawn.ComputeVisibility(time) == "invisible":
            continue
        if drawn.ComputePurpose() not in purposes or any(p.IsA(UsdGeom.PointInstancer) for p in _above(prim)):
            continue
        if prim.IsA(UsdGeom.Mesh):
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(time) or np.empty((0, 3)), float)
        else:
            box = boxes.ComputeUntransformedBound(prim).ComputeAlignedRange()
            points = np.array([box.GetCorner(i) for i in range(8)] if not box.IsEmpty() else np.empty((0, 3)))
        matrix = np.array(places.GetLocalToWorldTransform(prim))
        if len(points):
            moved = points @ matrix[:3, :3] + matrix[3, :3]
            corners += [moved.min(0), moved.max(0)]
    if not corners:
        sys.exit("pxr finds no geometry")
    authored = UsdGeom.StageHasAuthoredMetersPerUnit(stage)
    metres = float(UsdGeom.GetStageMetersPerUnit(stage)) if authored else None
    return {"bounds": [np.min(corners, 0).tolist(), np.max(corners, 0).tolist()], "metres_per_unit": metres}


def _above(prim: Any) -> Iterator[Any]:
    """Its ancestors."""
    while prim := prim.GetParent():
        yield prim


def _of_mesh(file: Path) -> dict[str, object]:
    import trimesh

    scene = trimesh.load_scene(file, process=False)
    if scene.bounds is None:
        sys.exit("trimesh finds no geometry")
    return {
        "bounds": scene.bounds.tolist(),
        "metres_per_unit": None if file.suffix.lower() in UNITLESS else 1.0,
    }


if __name__ == "__main__":
    main()

"""The prims of a target that are left out: the ones that a pattern matches, and levels of detail beside a finer one.

Exporters of games name levels `craft_LOD0`, the finest, `craft_LOD1` and so on, and put all of them in one place.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from spin_usd.basics.pluralise import pluralise
from spin_usd.errors import InputError
from spin_usd.scene.name_rule import NameRule
from spin_usd.stage.author.model_surfaces import prim_names
from spin_usd.stage.author.target_asset import TargetAsset, gprims_of
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.usd.layer_file import layer_at
from spin_usd.stage.usd.visibility import PROXIES, RENDERED_PURPOSES

LEVEL = re.compile(r"(?:(?<![A-Za-z])[Ll][Oo][Dd]|(?<=[a-z])LOD)[ _.-]?(\d{1,2})(?!\d)")
MATERIAL = (UsdShade.NodeGraph, UsdShade.Shader, UsdGeom.Subset)
PACKAGE = ".usdz"
COPY = 0.01  # of a box: nearer ones are of the same shape twice
LARGE, MOST = 0.05, 2000  # of the target's diagonal, and in number: the boxes that are compared


def leave_out(asset: TargetAsset, patterns: Sequence[str], where: object) -> TargetAsset:
    """Deactivate the prims of `asset` that one of the patterns matches, then the levels of detail beside a finer one,
    and note them and further pairs that look like levels. Raises InputError for a pattern without a match."""
    layer = layer_at(asset.file)
    stage = stage_on(layer)
    root = stage.GetPrimAtPath(asset.prim) if asset.prim else stage.GetDefaultPrim()
    below = [prim for prim in Usd.PrimRange(root, PROXIES) if prim != root and not any(map(prim.IsA, MATERIAL))]
    names = {prim.GetPath(): prim_names(prim) for prim in below}
    given = [path for pattern in patterns for path in _matched(names, pattern, where)]
    shapes = [prim.GetPath() for prim in below if prim.IsA(UsdGeom.Gprim)]
    shapes = [path for path in shapes if not any(path.HasPrefix(each) for each in given)]
    if given and not shapes:
        raise InputError("leave_out leaves nothing of the target", where=where, do="give narrower patterns")
    coarse = [] if asset.file.suffix == PACKAGE else _coarser(shapes, names, root.GetPath())
    notes = [f"{pluralise(len(given), 'prim')} left out, as given"] if given else []
    if coarse:
        named = ", ".join(path.name for path in coarse[:3]) + ", ..." * (len(coarse) > 3)
        notes.append(f"coarser levels of detail are left out ({named}): --leave-out of the finer ones shows them")
    if left := [*given, *coarse]:
        if asset.file.suffix == PACKAGE:
            raise InputError("is a package, of which nothing can be left out", where=where, do="unpack it")
        _deactivate(stage, left)
        layer.Save()
    kept = [stage.GetPrimAtPath(path) for path in shapes if path not in coarse]
    notes += _alike(root, kept)
    gone = asset.left_out or bool(left)
    return replace(asset, notes=(*asset.notes, *notes), gprims=len(gprims_of(root)), left_out=gone)


def _matched(names: Mapping[Sdf.Path, Sequence[str]], pattern: str, where: object) -> list[Sdf.Path]:
    rule = NameRule(pattern=pattern)
    found = [path for path, own in names.items() if rule.matches(own)]
    if not found:
        do = f"its prims are {', '.join(dict.fromkeys(path.name for path in names))}"
        raise InputError(f"leave_out {pattern!r} matches no prim of the target", where=where, do=do)
    return found


def _coarser(shapes: Sequence[Sdf.Path], names: Mapping[Sdf.Path, Sequence[str]], root: Sdf.Path) -> list[Sdf.Path]:
    """Return the shapes whose name, or a name above it, is of a level that has a finer one: LOD1 beside LOD0 after the
    same beginning."""
    levels: defaultdict[str, dict[Sdf.Path, int]] = defaultdict(dict)
    for path in shapes:
        own = (name for above in path.GetPrefixes() if above != root for name in names.get(above, ()))
        if found := next(filter(None, map(LEVEL.search, own)), None):
            levels[found.string[: found.start()].lower()][path] = int(found[1])
    return [path for each in levels.values() for path, level in each.items() if level > min(each.values())]


def _deactivate(stage: Usd.Stage, paths: Sequence[Sdf.Path]) -> None:
    """Deactivate the prims at these paths; instances that hold some become plain prims."""
    for path in paths:
        for above in path.GetPrefixes()[:-1]:
            if stage.GetPrimAtPath(above).IsInstance():
                stage.GetPrimAtPath(above).SetInstanceable(False)
    for path in paths:
        if prim := stage.GetPrimAtPath(path):  # else it is below another one
            prim.SetActive(False)


def _alike(root: Usd.Prim, shapes: Sequence[Usd.Prim]) -> Iterator[str]:
    """Yield a note on large rendered shapes that fill the same box, except for ones that a skeleton moves."""
    cache = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), RENDERED_PURPOSES)
    still = [prim for prim in shapes if not prim.HasAttribute("primvars:skel:jointIndices")]
    found = {prim: cache.ComputeRelativeBound(prim, root).ComputeAlignedRange() for prim in still}
    shapes = [prim for prim, each in found.items() if not each.IsEmpty()]
    if not shapes:
        return
    boxes = np.array([[*found[prim].GetMin(), *found[prim].GetMax()] for prim in shapes]).reshape(-1, 2, 3)
    edges = np.ptp(boxes, axis=1)
    large = np.flatnonzero(np.linalg.norm(edges, axis=1) > LARGE * np.linalg.norm(np.ptp(boxes, axis=(0, 1))))[:MOST]
    for n, one in enumerate(large):
        same = (np.abs(boxes[large[n + 1 :]] - boxes[one]) <= COPY * edges[one]).all((1, 2))
        if same.any():
            other = shapes[large[n + 1 :][same][0]].GetName()
            yield (
                f"{shapes[one].GetName()} and {other} fill the same box: if they are levels of detail of one shape, "
                f"keep one, with --leave-out {other}"
            )
            return

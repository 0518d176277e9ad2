"""The size of a USD target in its own file, by UsdGeom's own computations: an authority apart from our own readers.

Extents that the file authors are ignored: many are stale.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel

from spin_usd.basics.arrays import Float
from spin_usd.errors import GeometryError, StageError, UnsupportedError
from spin_usd.geometry.triangles import newell
from spin_usd.scene.scene import NOMINAL
from spin_usd.scene.source_bounds import SourceBounds
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.composition.images import Images
from spin_usd.stage.composition.open_stage import open_as_it_is
from spin_usd.stage.read.bodies.body_parts import BodyParts
from spin_usd.stage.read.bodies.find_bodies import find_target
from spin_usd.stage.read.bodies.target import TargetReader
from spin_usd.stage.read.frames import read_frames
from spin_usd.stage.usd.draw_modes import stand_ins
from spin_usd.stage.usd.root_metadata import METRES_PER_UNIT, Notes, root_number
from spin_usd.stage.usd.time_variation import stated_attributes
from spin_usd.stage.usd.values import read, read_any
from spin_usd.stage.usd.visibility import PROXIES, RENDERED_PURPOSES

FLAT_SURFACES = (UsdGeom.Tokens.none, UsdGeom.Tokens.bilinear)


def usd_bounds(
    file: Path, prim: str | None, *, metres_per_unit: float, selections: Mapping[str, str], time_code: float
) -> SourceBounds | None:
    """Measure all at and below `prim`, the default prim where None, in metres, at one time and with the variants
    `selections` of that prim. Returns None where nothing has a size."""
    stage = open_as_it_is(file)
    root = stage.GetPrimAtPath(prim) if prim else stage.GetDefaultPrim() or stage.GetPseudoRoot()
    time = Usd.TimeCode(time_code)
    stated = UsdGeom.StageHasAuthoredMetersPerUnit(stage)
    metres = root_number(stage, METRES_PER_UNIT) if stated else metres_per_unit
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for name, variant in selections.items():
            root.GetVariantSet(name).SetVariantSelection(variant)
        _expand_instances(root)
        _bake_skeletons(root, time)
        _leave_out_lights(root)
        _block_extents(root)
    cache = UsdGeom.BBoxCache(time, list(RENDERED_PURPOSES), useExtentsHint=False)
    box = cache.ComputeLocalBound(root).ComputeAlignedRange()
    if box.IsEmpty():
        return None
    polygons, only = _polygons(root, time)
    whole = np.array([box.GetMin(), box.GetMax()]) * metres
    if polygons is None:
        return SourceBounds(whole=whole, polygons=None, exact=False)
    return SourceBounds(whole=polygons * metres if only else whole, polygons=polygons * metres, exact=only)


def _expand_instances(root: Usd.Prim) -> None:
    """Turn instances into plain prims, so that their extents can be blocked."""
    while instances := [prim for prim in Usd.PrimRange(root) if prim.IsInstance()]:
        for prim in instances:
            prim.SetInstanceable(False)


def _bake_skeletons(root: Usd.Prim, time: Usd.TimeCode) -> None:
    """Bake the points that skeletons deform at `time`: USD's own extent of a SkelRoot holds little more than its
    joints. Animations are made constant first, since baking looks only at their own time samples."""
    for prim in root.GetStage().Traverse():
        if prim.IsA(UsdSkel.Animation):
            for attribute in stated_attributes(prim):
                if (value := read_any(attribute, time)) is not None:
                    attribute.Set(value)
    moment = Gf.Interval(time.GetValue(), time.GetValue())
    for prim in [prim for prim in Usd.PrimRange(root) if prim.IsA(UsdSkel.Root)]:
        UsdSkel.BakeSkinning(UsdSkel.Root(prim), moment)
    for prim in [prim for prim in Usd.PrimRange(root) if prim.IsA(UsdSkel.Skeleton)]:
        UsdGeom.Imageable(prim).GetPurposeAttr().Set(UsdGeom.Tokens.guide)  # its joints are not part of the craft


def _leave_out_lights(root: Usd.Prim) -> None:
    """Lights have an extent, and are not part of the craft."""
    for prim in Usd.PrimRange(root):
        if prim.HasAPI(UsdLux.LightAPI) and not prim.IsA(UsdGeom.Gprim):
            UsdGeom.Imageable(prim).GetPurposeAttr().Set(UsdGeom.Tokens.guide)


def _block_extents(root: Usd.Prim) -> None:
    for prim in Usd.PrimRange(root):
        if prim.IsA(UsdGeom.Boundable):
            UsdGeom.Boundable(prim).GetExtentAttr().Block()


def _polygons(root: Usd.Prim, time: Usd.TimeCode) -> tuple[Float | None, bool]:
    """Return the box (2, 3) of the plain polygons in the axes of the root's parent, None without any; and whether
    nothing else is rendered. A mesh that a material displaces or a skeleton deforms is not plain."""
    only, boxes = True, []
    world = UsdGeom.XformCache(time)
    to_body = world.GetParentToWorldTransform(root).GetInverse()
    displaced = any(_displaces(prim) for prim in Usd.PrimRange(root))
    everything = iter(Usd.PrimRange(root))
    for prim in everything:
        if not prim.IsA(UsdGeom.Boundable) or not _is_rendered(prim, time):
            continue
        if prim.IsA(UsdGeom.PointInstancer):
            everything.PruneChildren()
        mesh = UsdGeom.Mesh(prim)
        plain = mesh and not displaced and _is_flat(mesh) and not _is_deformed(prim)
        corners = _corners(mesh, time) if plain else np.zeros((0, 3))
        only &= bool(plain)
        if len(corners):
            placed = corners @ _matrix(world.GetLocalToWorldTransform(prim) * to_body)
            boxes += [placed[:, :3].min(0), placed[:, :3].max(0)]
    return (np.stack([np.min(boxes, 0), np.max(boxes, 0)]) if boxes else None), only


def _is_flat(mesh: UsdGeom.Mesh) -> bool:
    return bool(read(mesh.GetSubdivisionSchemeAttr()) in FLAT_SURFACES)


def _corners(mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> Float:
    """Return the homogeneous points (N, 4) of the faces that have an area; none where the arrays disagree."""
    points = np.array(mesh.ComputePointsAtTime(time, time) or [], np.float64).reshape(-1, 3)
    counts = np.array(read(mesh.GetFaceVertexCountsAttr(), time) or [], np.int64)
    indices = np.array(read(mesh.GetFaceVertexIndicesAttr(), time) or [], np.int64)
    if not len(points) or counts.sum() != len(indices) or (len(indices) and indices.max() >= len(points)):
        return np.zeros((0, 4))
    starts, used = np.cumsum(counts) - counts, []
    holes = np.array(read(mesh.GetHoleIndicesAttr(), time) or [], np.int64)
    for size in np.unique(counts[counts >= 3]):
        faces = np.setdiff1d(np.flatnonzero(counts == size), holes)
        polygons = points[indices[starts[faces][:, None] + np.arange(size)]]
        used.append(polygons[np.linalg.norm(newell(polygons), axis=-1) > 0].reshape(-1, 3))
    corners = np.concatenate([np.zeros((0, 3)), *used])
    return np.column_stack([corners, np.ones(len(corners))])


def _matrix(matrix: Gf.Matrix4d) -> Float:
    return np.array(matrix, np.float64)


def _is_rendered(prim: Usd.Prim, time: Usd.TimeCode) -> bool:
    geometry = UsdGeom.Imageable(prim)
    shown = geometry.ComputeVisibility(time) != UsdGeom.Tokens.invisible
    return shown and geometry.ComputePurpose() in RENDERED_PURPOSES


def _is_deformed(prim: Usd.Prim) -> bool:
    """Return whether a skeleton deforms the prim."""
    return bool(prim.HasAPI(UsdSkel.BindingAPI) and UsdSkel.BindingAPI(prim).GetInheritedSkeleton())


def _displaces(prim: Usd.Prim) -> bool:
    """Return whether `prim` is a shader that may displace surfaces."""
    shader = UsdShade.Shader(prim)
    found = shader and shader.GetInput("displacement")
    return bool(found) and (found.HasConnectedSource() or bool(read_any(found.GetAttr())))


def target_notes(stage: Usd.Stage) -> tuple[str, ...]:
    """Return sentences on the target of `stage`: where it moves in time, where other programs show a stand-in, and
    where subdivision makes it smoother than was perhaps meant."""
    target = find_target(stage)
    return (*_motion(stage, target), *_draw_modes(target), *_smoothed(target), *_coloured_instances(target))


def _coloured_instances(target: Usd.Prim) -> Iterator[str]:
    """Note instancers with a colour for each instance: instances share their prototype's material."""
    for prim in Usd.PrimRange(target, PROXIES):
        color = UsdGeom.PrimvarsAPI(prim).GetPrimvar("displayColor")
        if prim.IsA(UsdGeom.PointInstancer) and color and color.GetInterpolation() != UsdGeom.Tokens.constant:
            yield f"{prim.GetPath()} colours each instance by displayColor: all are shown as their prototypes are"


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
    for attribute in stated_attributes(prim):
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


def hull_corners(target: TargetAsset) -> Float:
    """Compute the corners (N, 3) of the target's convex hull: metres, in its own axes. Of a target that a render will
    refuse, the corners of its box."""
    try:
        return _hull(target)
    except (StageError, UnsupportedError, GeometryError):
        return box_corners(target)


def _hull(target: TargetAsset) -> Float:
    stage, time = open_as_it_is(target.file), Usd.TimeCode.EarliestTime()
    root = _root(stage, target)
    reader = TargetReader(
        prim=root,
        parts=BodyParts().add(root),
        time=time,
        group_of=lambda _: 0,
        images=Images(check=False),
        notes=Notes(),
    )
    own = reader.read(1.0).mesh.hull
    placed = np.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(root))  # for row vectors
    corners: Float = (own @ placed[:3, :3] + placed[3, :3]) * target.metres_per_unit
    return corners


def box_corners(target: TargetAsset) -> Float:
    """Compute the corners (8, 3) of the target's bounding box: metres, in its own axes. If USD finds no box, as for a
    SkelRoot without an extent, the box of its hull."""
    stage = open_as_it_is(target.file)
    cache = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), list(RENDERED_PURPOSES))
    box = cache.ComputeWorldBound(_root(stage, target)).ComputeAlignedRange()
    corners = np.array([box.GetCorner(i) for i in range(8)], np.float64) * target.metres_per_unit
    if np.ptp(corners, axis=0).any():
        return corners
    try:
        return _hull(target)
    except (StageError, UnsupportedError, GeometryError):
        return corners


def _root(stage: Usd.Stage, target: TargetAsset) -> Usd.Prim:
    return stage.GetPrimAtPath(target.prim) if target.prim else stage.GetDefaultPrim()

"""The child's part of `check --cross`: a picture's labels cast again by Cycles, and their differences.

Both passes cast a ray through each pixel's centre. Cycles' misses it by 1e-3 px at most, by float32 (the first ray of
its own camera by 0.0007 px, the lens's inverse by 1e-4 px). So where an edge passes this close to a pixel's centre,
either answer is right: this holds for 2 in 1,000 pixels at edges. Elsewhere the point on the surface moves by as much,
and by more where the surface is seen at a shallow angle: by ten times as much where its slope is ten.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.commands.check.calls import CheckPicture, CrossAnswer
from spin_usd.commands.check.digests import MAKE_AGAIN
from spin_usd.commands.check.in_child.picture import read_arrays
from spin_usd.errors import SpinError
from spin_usd.files.folder import Folder
from spin_usd.geometry.camera import Camera
from spin_usd.picture.make_picture import Stopwatch, make_labels
from spin_usd.processes.open_renderer import open_check_pass
from spin_usd.records.record import Record
from spin_usd.renderers.renderer import LabelPass
from spin_usd.scene.derived.coincidence import GAP
from spin_usd.scene.derived.faces import corners_of, parts_of
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.scene.scene import Scene
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.store.read_documents import read_record

COMPARED = ("segmentation", "depth", "dense_pose")
MAX_LOOKED = 4096  # pixels at which coincident parts are looked for: more that differ are a fault whatever they show
FACES_AT_ONCE = 512
ON_EDGE = 1e-9  # of a triangle, in barycentric weights
RAY_PX = 1e-3  # that the passes' rays are apart at most
STEEP = 10.0  # slope above which a surface counts as an edge
ROUNDINGS = 4 * 2.0**-24  # of float32 in the files, relative
EDGE_SHARE = 0.01  # of the pixels at an edge: five times as many as may be expected
FEW = 3  # further pixels that may differ elsewhere: a sliver that only one pass hits is no edge to the other

Mask = NDArray[np.bool_]
Labels = Mapping[str, NDArray[Any]]
"""Some of segmentation (H, W), depth (H, W) and dense_pose (H, W, 3), as their files hold them, by name."""


def cross_findings(request: CheckPicture) -> CrossAnswer:
    """Compare the labels of a picture. There is no finding on a record or a file that cannot be used: `check` has one
    by itself."""
    root, record = Path(request.dataset), request.record
    try:
        content = read_record(Folder(root), record)
    except SpinError:
        return CrossAnswer(findings=[], compared=False)
    files = {kind: entry for kind, entry in content.files.items() if kind in COMPARED}
    arrays = dict(read_arrays(root, files))
    ours = {kind: array for kind, array in arrays.items() if not isinstance(array, Finding)}
    if len(ours) < len(arrays):
        return CrossAnswer(findings=[], compared=False)
    if not ours:
        message = f"holds none of {', '.join(COMPARED)}, so nothing can be compared"
        finding = Finding(code="cross", where=record, message=message, severity=WARNING)
        return CrossAnswer(findings=[finding], compared=False)
    scene = _scene(root, content)
    if scene is None or any(array.shape[:2] != scene.camera.frame.shape for array in ours.values()):
        message = f"is not of the dataset's stage; {MAKE_AGAIN}"
        return CrossAnswer(findings=[Finding(code="cross", where=record, message=message)], compared=False)
    return CrossAnswer(findings=list(_findings(record, scene, ours)), compared=True)


def _findings(where: str, scene: Scene, ours: Labels) -> Iterator[Finding]:
    """Yield where our labels of the scene's picture differ from Cycles' in more pixels than allowed."""
    theirs = {kind: array for kind, array, _ in make_labels(scene, _check_pass(), COMPARED, Stopwatch())}
    coincident = _coincident(scene, ours, theirs)
    for each in disagreements(ours, theirs, scene.camera, coincident=coincident):
        worst = f", by {each.worst} at the worst" if each.worst else ""
        message = (
            f"the {each.quantity} differs from Cycles' result in {each.pixels} pixels {each.place}{worst}, "
            f"and may in {each.allowed}; {MAKE_AGAIN}"
        )
        yield Finding(code="cross", where=where, message=message)


def _scene(root: Path, record: Record) -> Scene | None:
    """Return the scene of the record's picture, as the dataset's own stage has it; None where it has no such
    picture."""
    reader = _reader(str(Folder(root).path(record.provenance.stage.root)), record.variant)
    frames, index = reader.frames, record.index
    return reader.scene(frames[index]) if index < len(frames) and frames[index].name == record.frame else None


@lru_cache(maxsize=1)
def _reader(stage: str, variant: str) -> StageReader:
    return StageReader(stage, variant=variant)


@cache
def _check_pass() -> LabelPass:
    return open_check_pass()


def _coincident(scene: Scene, ours: Labels, theirs: Labels) -> Mask:
    """Return (H, W) where the part in our segmentation has a face in the surface that `theirs` shows as another
    part's."""
    found = np.zeros(scene.camera.frame.shape, bool)
    if "segmentation" not in ours:
        return found
    parts, others = ours["segmentation"], theirs["segmentation"]
    rows, columns = (index[:MAX_LOOKED] for index in np.nonzero((parts > 0) & (others > 0) & (parts != others)))
    xy = scene.camera.centres(scene.camera.frame)[rows, columns]
    depth = theirs["depth"][rows, columns].astype(np.float64)
    for part in np.unique(parts[rows, columns]):
        at = np.flatnonzero(parts[rows, columns] == part)
        found[rows[at], columns[at]] = _lies_there(scene, int(part), xy[at], depth[at])
    return found


def _lies_there(scene: Scene, part: int, xy: Float, depth: Float) -> Mask:
    """Return (N,) whether a face of the part with that id in labels lies at the `depth` (N,), metres, of the rays (x,
    y, 1) of `xy` (N, 2), or so close to it that no renderer can distinguish."""
    place = int(np.searchsorted(scene.part_offsets, part)) - 1
    one, own = scene.one_body_scenes[place], part - scene.part_offsets[place]
    mesh = one.target.mesh
    faces = np.flatnonzero(parts_of(mesh, np.arange(mesh.count)) == own)
    rays, there = np.insert(xy, 2, 1.0, axis=1), np.zeros(len(xy), bool)
    for start in range(0, len(faces), FACES_AT_ONCE):
        corners = one.T_cam_body.points(corners_of(mesh, faces[start : start + FACES_AT_ONCE]))
        near = np.abs(_depths(rays, corners) - depth[:, None]) <= GAP * mesh.radius + ROUNDINGS * depth[:, None]
        there |= near.any(1)
    return there


def _depths(rays: Float, corners: Float) -> Float:
    """Return (N, F) the depth at which each of the rays (N, 3), whose z is 1, meets each triangle (F, 3, 3), camera
    frame; infinite where it does not."""
    a, b, c = corners.swapaxes(0, 1)
    weights: NDArray[np.float64] = np.stack([rays @ np.cross(p, q).T for p, q in ((b, c), (c, a), (a, b))])
    whole = weights.sum(0)
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = (weights / whole >= -ON_EDGE).all(0)
        return np.where(inside, (a * np.cross(b, c)).sum(1) / whole, np.inf)


@dataclass(frozen=True, kw_only=True)
class Disagreement:
    """A quantity that differs in more pixels than `allowed`."""

    quantity: str
    place: str
    """"at edges" or "elsewhere"."""
    pixels: int
    allowed: int
    worst: str = ""
    """By how much at most, with its unit; "" for a quantity that is the same or another."""


def disagreements(ours: Labels, theirs: Labels, camera: Camera, *, coincident: Mask) -> Iterator[Disagreement]:
    """Yield labels that differ in more pixels than allowed. `coincident` (H, W): where surfaces of several parts
    coincide, so that either part may be visible."""
    seen, other = _seen(ours), _seen(theirs)
    edges = _edges(theirs, camera)  # of the pass that is trusted here: faults of ours may look like an edge
    both = seen & other
    yield from _counted("silhouette", seen != other, edges)
    if "segmentation" in ours:
        differs = both & (ours["segmentation"] != theirs["segmentation"]) & ~coincident
        yield from _counted("part", differs, edges)
    if "depth" in ours:
        depth = theirs["depth"].astype(np.float64)
        off = np.abs(ours["depth"] - depth)
        yield from _counted("depth", both & ~(off <= _slide(depth, camera) + ROUNDINGS * depth), edges, off)
    if "dense_pose" in ours:
        yield from _body(ours, theirs, camera, edges)


def _body(ours: Labels, theirs: Labels, camera: Camera, edges: Mask) -> Iterator[Disagreement]:
    """Yield the disagreement of body points, where both have one and how far away they are is known."""
    mine, other = ours["dense_pose"].astype(np.float64), theirs["dense_pose"].astype(np.float64)
    depth = theirs["depth"].astype(np.float64)
    both = mine.any(-1) & other.any(-1)
    off = np.linalg.norm(mine - other, axis=-1)
    rounding = ROUNDINGS * np.linalg.norm(other, axis=-1)
    yield from _counted("body point", both & ~(off <= _slide(depth, camera) + rounding), edges, off)


def _counted(quantity: str, differs: Mask, edges: Mask, off: Float | None = None) -> Iterator[Disagreement]:
    """Yield where more pixels differ than may."""
    at_edges = FEW + int(EDGE_SHARE * np.count_nonzero(edges))
    for place, there, allowed in (("at edges", differs & edges, at_edges), ("elsewhere", differs & ~edges, FEW)):
        pixels = int(np.count_nonzero(there))
        if pixels > allowed:
            worst = "" if off is None else f"{off[there].max():.2g} m"
            yield Disagreement(quantity=quantity, place=place, pixels=pixels, allowed=allowed, worst=worst)


def _seen(labels: Labels) -> Mask:
    """Return (H, W) where anything is seen."""
    for kind in ("segmentation", "depth"):
        if kind in labels:
            return np.asarray(labels[kind] > 0)
    return np.asarray(labels["dense_pose"].any(-1))


def _slide(depth: Float, camera: Camera) -> Float:
    """Return (H, W) metres by which points on a surface at that depth may differ."""
    return STEEP * RAY_PX / min(camera.fx, camera.fy) * depth


def _edges(labels: Labels, camera: Camera) -> Mask:
    """Return (H, W) the pixels beside which another part, another surface or nothing is seen."""
    edges = np.zeros((camera.height, camera.width), bool)
    planes = [_seen(labels).astype(np.float64)]
    planes += [labels["segmentation"].astype(np.float64)] if "segmentation" in labels else []
    for plane in planes:
        edges |= _steps(plane, np.zeros_like(plane))
    if "depth" in labels:
        depth = labels["depth"].astype(np.float64)
        edges |= _steps(depth, STEEP / min(camera.fx, camera.fy) * depth)
    return edges


def _steps(plane: Float, least: Float) -> Mask:
    """Return (H, W) where the plane differs from a neighbour's, across or down, by more than `least`."""
    steps = np.zeros(plane.shape, bool)
    across, down = np.abs(np.diff(plane, axis=1)), np.abs(np.diff(plane, axis=0))
    right, below = across > least[:, 1:], down > least[1:]
    steps[:, 1:] |= right
    steps[:, :-1] |= right
    steps[1:] |= below
    steps[:-1] |= below
    return steps

"""Where labels differ from those of another label pass by more than two exact passes may.

Both passes cast a ray through each pixel's centre. Cycles' misses it by 1e-3 px at most, by float32 (the first ray of
its own camera by 0.0007 px, the lens's inverse by 1e-4 px). So where an edge passes as near to a pixel's centre either
answer is right: that is so of 2 in 1,000 pixels at edges. Elsewhere the point on the surface moves by as much, and by
more where the surface is seen at a flat angle: by ten times as much where its slope is ten.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.camera import Camera

RAY_PX = 1e-3  # that the passes' rays are apart at most
STEEP = 10.0  # slope above which a surface counts as an edge
ROUNDINGS = 4 * 2.0**-24  # of float32 in the files, relative
EDGE_SHARE = 0.01  # of the pixels at an edge: five times as many as may be expected
FEW = 3  # pixels that may differ besides, and elsewhere: a sliver that only one pass meets is no edge to the other

Mask = NDArray[np.bool_]
Labels = Mapping[str, NDArray[Any]]
"""Some of segmentation (H, W), depth (H, W) and dense_pose (H, W, 3), as their files hold them, by name."""


@dataclass(frozen=True, kw_only=True)
class Disagreement:
    """The `quantity` that differs in so many `pixels` of a `place`, "at edges" or "elsewhere", where `allowed` may
    differ. worst: by how much at most, with its unit; "" for a quantity that is the same or another."""

    quantity: str
    place: str
    pixels: int
    allowed: int
    worst: str = ""


def disagreements(ours: Labels, theirs: Labels, camera: Camera, *, coincident: Mask) -> Iterator[Disagreement]:
    """Yield what differs in more pixels than may. `coincident` (H, W): where surfaces of several parts lie in one
    another, so that either part may be seen."""
    seen, other = _seen(ours), _seen(theirs)
    edges = _edges(theirs, camera)  # of the pass that is trusted here: what is wrong in ours may look like an edge
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

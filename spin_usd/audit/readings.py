"""Which reading of a set's poses puts its labels right: order and direction of rotations, positions, mirrored labels.

No model is needed. Of the eight readings of a pose, and mirrored labels, only the right one leaves a body that is the
same in all pictures. With keypoints the points of the body are found by least squares from all pictures, and the
reading is right that projects them where they are labelled. With boxes, or masks, whose boxes are taken, the body is
carved: of a grid of points those remain that lie inside the boxes of all pictures, and the reading is right whose
remaining body fills its boxes (a visual hull; Laurentini 1994).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from spin_usd.audit.posed_targets import PosedTargets
from spin_usd.basics.arrays import Float

FEWEST = 8  # pictures for a verdict
MOST = 60  # pictures that are tried
GRID = 22  # points across the carved body
INSIDE = 0.95, 0.85, 0.75  # shares of the pictures in which a point of the body must lie in the box: tried in turn
CONSTANT = 0.05  # spread of the rotations below which all readings leave some body
MIRRORS = ("", "left to right", "upside down")


@dataclass(frozen=True, kw_only=True)
class Reading:
    """One way of reading the numbers of poses."""

    other_order: bool = False
    """Whether a quaternion's scalar is at the other end than in the layout."""
    inverse: bool = False
    """Whether rotations are the inverse of the layout's."""
    of_camera: bool = False
    """Whether positions are of the camera in the body's axes, not of the body in the camera's."""
    mirrored: str = ""
    """How labels in the image are mirrored; "" for not at all."""

    @property
    def name(self) -> str:
        """Its difference from the layout's own, in words."""
        said = [
            "the quaternion's scalar at the other end" * self.other_order,
            "the inverse rotations" * self.inverse,
            "positions of the camera in the body's axes" * self.of_camera,
            f"labels mirrored {self.mirrored}" * bool(self.mirrored),
        ]
        return " and ".join(each for each in said if each)

    def poses(self, targets: PosedTargets) -> tuple[Float, Float]:
        """Return R_cam_body (N, 3, 3) and t_cam_body (N, 3) so read."""
        R, t = targets.rotations(other_order=self.other_order, inverse=self.inverse), targets.t
        return R, -np.einsum("nij,nj->ni", R, t) if self.of_camera else t

    def boxes(self, targets: PosedTargets) -> Float:
        """Return the boxes (N, 4), pixels."""
        boxes, (width, height) = targets.boxes.copy(), targets.sizes.T
        if self.mirrored == "left to right":
            boxes[:, 0], boxes[:, 2] = width - targets.boxes[:, 2], width - targets.boxes[:, 0]
        if self.mirrored == "upside down":
            boxes[:, 1], boxes[:, 3] = height - targets.boxes[:, 3], height - targets.boxes[:, 1]
        return boxes


def readings(targets: PosedTargets) -> Iterator[Reading]:
    """Yield the readings that are possible for these targets, the layout's own first."""
    orders = (False, True) if np.isfinite(targets.quaternions).all() else (False,)
    for mirrored, of_camera, inverse, other_order in product(MIRRORS, (False, True), (False, True), orders):
        yield Reading(other_order=other_order, inverse=inverse, of_camera=of_camera, mirrored=mirrored)


@dataclass(frozen=True, kw_only=True)
class Fit:
    """How well a reading agrees with labels."""

    reading: Reading
    score: float
    """Median overlap of boxes (IoU), or the median error of keypoints, pixels, subtracted from 0."""
    each: Float
    """(N,) the same of each target; NaN where it has no labels."""
    ratio: Float | None = None
    """(N,) size of the boxes over the body's, where both are whole; else NaN."""
    apart: Float | None = None
    """(N,) largest distance between sides of the two boxes, pixels."""
    residuals: Float | None = None
    """(N, K, 2) errors of keypoints, labelled less projected, pixels."""


def turned_enough(targets: PosedTargets) -> bool:
    """Return whether attitudes differ enough to tell readings apart."""
    rotations = targets.rotations()
    return bool(np.linalg.norm(rotations.mean(0) - rotations[0]) > CONSTANT)


def by_boxes(targets: PosedTargets, reading: Reading, model: Float | None = None) -> Fit:
    """Return how well boxes agree with the points (M, 3) of a `model`, or of a body that is carved from the boxes."""
    boxes = targets.normalised(reading.boxes(targets))
    there = np.flatnonzero(~np.isnan(boxes).any(1))
    R, t = reading.poses(targets)
    there = there[t[there, 2] > 0]
    none = Fit(reading=reading, score=0.0, each=np.where(np.isnan(boxes).any(1), np.nan, 0.0))
    if len(there) < (FEWEST if model is None else 1):
        return none
    few = there[:: max(1, len(there) // MOST)]
    bodies = _carved(R[few], t[few], boxes[few]) if model is None else [model]
    if not bodies:
        return none
    body = max(bodies, key=lambda each: np.median(_overlaps(_made(each, R[few], t[few]), boxes[few])[0]))
    each, ratio, apart = np.full((3, len(targets)), np.nan)
    for places in np.array_split(there, max(1, len(there) * len(body) // 2_000_000)):
        made = _made(body, R[places], t[places])
        each[places], ratio[places], apart[places] = _overlaps(made, boxes[places])
    apart *= targets.focal
    return Fit(reading=reading, score=float(np.median(each[there])), each=each, ratio=ratio, apart=apart)


def _carved(R: Float, t: Float, boxes: Float) -> list[Float]:
    """Return the points (M, 3) of a grid that lie in nearly all boxes, once for each share of INSIDE that leaves
    any: where some poses or boxes are wrong, a smaller share leaves the right body."""
    sides = np.abs(np.stack([boxes[:, :2], boxes[:, 2:]], 1) - (t[:, None, :2] / t[:, None, 2:]))
    reach = np.where(np.isfinite(sides), sides, 0).reshape(len(t), -1).max(1) * t[:, 2]
    radius = float(np.percentile(reach[reach > 0], 75)) if (reach > 0).any() else 0.0
    points = _grid(np.full(3, -radius), np.full(3, radius))
    rough = points[_inside(points, R, t, boxes) >= INSIDE[-1]]
    if not len(rough) or not radius:
        return []
    step = 2 * radius / (GRID - 1)
    points = _grid(rough.min(0) - step, rough.max(0) + step)
    shares = _inside(points, R, t, boxes)
    return [points[shares >= least] for least in INSIDE if (shares >= least).any()]


def _grid(low: Float, high: Float) -> Float:
    axes = [np.linspace(*ends, GRID) for ends in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def _inside(points: Float, R: Float, t: Float, boxes: Float) -> Float:
    """Return (M,) the share of the boxes in which each point lies."""
    counts = np.zeros(len(points))
    for rotation, place, box in zip(R, t, boxes, strict=True):
        seen = points @ rotation.T + place
        xy = seen[:, :2] / np.where(seen[:, 2:] > 0, seen[:, 2:], np.nan)
        slack = 0.02 * np.nan_to_num(box[2:] - box[:2], posinf=0.0)
        counts += ((xy >= box[:2] - slack) & (xy <= box[2:] + slack)).all(1)
    return counts / len(R)


def _made(body: Float, R: Float, t: Float) -> Float:
    """Return the boxes (n, 4) of the body's points in normalised coordinates."""
    seen = np.einsum("nij,mj->nmi", R, body) + t[:, None]
    xy = seen[..., :2] / np.maximum(seen[..., 2:], 1e-9)
    return np.concatenate([xy.min(1), xy.max(1)], 1)


def _overlaps(made: Float, boxes: Float) -> tuple[Float, Float, Float]:
    """Return (n,) the overlap (IoU) of boxes inside the frame, the ratio of their diagonals, NaN where the frame cuts
    one off, and the largest distance of their sides."""
    whole = np.isfinite(boxes).all(1)
    cut = np.where(np.isinf(boxes), made, boxes)  # beyond the frame the label is unknown
    low, high = np.maximum(made[:, :2], cut[:, :2]), np.minimum(made[:, 2:], cut[:, 2:])
    both = np.prod(np.maximum(high - low, 0), axis=1)
    sides = [np.maximum(each[:, 2:] - each[:, :2], 0) for each in (made, cut)]
    areas = [np.prod(each, axis=1) for each in sides]
    diagonals = [np.linalg.norm(each, axis=1) for each in sides]
    ratio = np.where(whole, diagonals[1] / np.maximum(diagonals[0], 1e-12), np.nan)
    return both / np.maximum(areas[0] + areas[1] - both, 1e-12), ratio, np.abs(made - cut).max(1)


@dataclass(frozen=True, kw_only=True)
class Outlines:
    """How well a model's outline follows the edges in pictures."""

    targets: PosedTargets
    scores: Float
    """(N, R) mean rank of the gradient under the outline in each reading, 0.5 by chance."""


def by_outlines(outlines: Outlines) -> list[Fit]:
    """Return how well each reading's outlines follow edges, the layout's own first."""
    columns = outlines.scores.T
    return [
        Fit(reading=reading, score=float(np.nanmedian(column)) if np.isfinite(column).any() else 0.0, each=column)
        for reading, column in zip(readings(outlines.targets), columns, strict=True)
    ]


def by_keypoints(targets: PosedTargets, reading: Reading) -> Fit | None:
    """Return how well keypoints agree with points of one body; None where too few pictures have them."""
    counts = {len(target.keypoints) for _, _, target, _ in targets.rows if target.keypoints is not None}
    if len(counts) != 1 or not (count := counts.pop()):
        return None
    xy, there = _labelled(targets, reading, count)
    if (there.sum(0) < FEWEST).all():
        return None
    R, t = reading.poses(targets)
    residuals = np.full(xy.shape, np.nan)
    focal = targets.focal
    for point in range(count):
        used = np.flatnonzero(there[:, point])
        if len(used) < FEWEST:
            continue
        body = _triangulated(R[used], t[used], xy[used, point])
        seen = R[used] @ body + t[used]
        residuals[used, point] = (xy[used, point] - seen[:, :2] / seen[:, 2:]) * focal[used, None]
    errors = np.linalg.norm(residuals, axis=2)
    each = np.full(len(targets), np.nan)
    some = np.isfinite(errors).any(1)
    each[some] = np.nanmedian(errors[some], axis=1)
    return Fit(reading=reading, score=-float(np.nanmedian(errors)), each=each, residuals=residuals)


def _labelled(targets: PosedTargets, reading: Reading, count: int) -> tuple[Float, NDArray[np.bool_]]:
    """Return the keypoints (N, K, 2) in normalised coordinates, without distortion, and which are labelled."""
    points = targets.keypoints(count)
    uv, size = points[..., :2].copy(), targets.sizes[:, None]
    if reading.mirrored == "left to right":
        uv[..., 0] = size[..., 0] - uv[..., 0]
    if reading.mirrored == "upside down":
        uv[..., 1] = size[..., 1] - uv[..., 1]
    there = (points[..., 2] > 0) & np.isfinite(points).all(2) & ((uv >= 0) & (uv <= size)).all(2)
    return targets.undistorted(uv, there), there


def _triangulated(R: Float, t: Float, xy: Float) -> Float:
    """Return the point (3,) of the body nearest to all rays, by least squares that trust the nearer half more."""
    rows = R[:, :2] - xy[..., None] * R[:, 2:]
    values = xy * t[:, 2:] - t[:, :2]
    weights = np.ones(len(R)) / np.maximum(np.abs(t[:, 2]), 1e-9)
    for _ in range(4):
        scaled = (rows * weights[:, None, None]).reshape(-1, 3)
        point = np.linalg.lstsq(scaled, (values * weights[:, None]).ravel(), rcond=None)[0]
        errors = np.linalg.norm(rows @ point - values, axis=1) / np.maximum(np.abs(t[:, 2]), 1e-9)
        weights = 1 / (np.maximum(np.abs(t[:, 2]), 1e-9) * np.maximum(errors, np.median(errors) + 1e-12))
    return np.asarray(point)

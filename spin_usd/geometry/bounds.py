"""The region of interest: the pixels that a body can cover, from its convex hull, in double precision."""

from functools import lru_cache
from math import ceil, floor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region

SAMPLES_PER_EDGE = 33  # straight edges bow under distortion; 33 points bound the bow to < 0.1 px on SPEED+
RIM_SAMPLES = 64  # per side of the frame
PADDING_PX = 2
DIRECTIONS = 16  # in which a polygon's furthest points are found at once: within them lies nothing of the hull
TURNS = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
TOWARDS = np.stack([np.cos(TURNS), np.sin(TURNS)], -1)
ALONG_EDGE = np.linspace(0, 1, SAMPLES_PER_EDGE, endpoint=False)
ALONG_ARC = np.linspace(0, 1, 257, endpoint=False)  # of up to half a turn, none bowed by more than 2e-5 f
ROUNDING = 1e-12  # of a polygon's extent: points so near to an edge are not taken for inner ones
SQUARE = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1.0]])
NEAR = 1e-6  # metres before the camera: nearer points have no place in the picture


def region_of_interest(
    camera: Camera, hull_cam: ArrayLike, near: float = NEAR, *, blur_radius: ArrayLike | None = None
) -> Region:
    """Return the smallest padded box of whole pixels that holds the projection of the hull's points (N, 3), metres,
    each blurred by `blur_radius` (N,) in undistorted normalised coordinates.

    The whole frame when the hull crosses the camera's plane before it; empty when it lies behind it or out of view.
    """
    uv = outline_of(camera, hull_cam, near, blur_radius=blur_radius)
    return camera.frame if uv is None else region_around(camera, uv)


def region_around(camera: Camera, outline: Float) -> Region:
    """Return the smallest padded box of whole pixels, within the frame, that holds the pixels `outline` (N, 2)."""
    if not len(outline):
        return Region(x0=0, y0=0, x1=0, y1=0)
    x, y = outline.T  # apart: numpy is slow along an axis of two
    box = Region(x0=floor(x.min()), y0=floor(y.min()), x1=ceil(x.max()), y1=ceil(y.max())).padded(PADDING_PX)
    clipped = box & camera.frame
    return Region(x0=0, y0=0, x1=0, y1=0) if clipped.empty else clipped


def outline_of(
    camera: Camera, hull_cam: ArrayLike, near: float = NEAR, *, blur_radius: ArrayLike | None = None
) -> Float | None:
    """Pixels (N, 2) one after another around what the hull covers of the frame and 2 px more; arguments are those of
    `region_of_interest`. None of them when it lies behind the camera or out of view; None where it crosses the
    camera's plane."""
    p = np.asarray(hull_cam, np.float64)
    if not len(p) or p[:, 2].max() <= near:
        return np.zeros((0, 2))
    if p[:, 2].min() <= near:
        return np.zeros((0, 2)) if blur_radius is None and beside(camera, p) else None
    xy = p[:, :2] / p[:, 2:]
    if blur_radius is not None:
        radius = np.asarray(blur_radius, np.float64)
        if not np.isfinite(radius).all():
            return None
        if radius.any():
            xy = (xy[:, None] + radius[:, None, None] * SQUARE).reshape(-1, 2)
    return camera.pixels(outline_in_view(camera, convex_hull_2d(xy)))


def beside(camera: Camera, points: Float, slack: float = 0.0) -> bool:
    """Return whether the points (N, 3), camera frame, before and behind the camera, all lie more than `slack` metres
    beyond one side of what it sees: so does their hull."""
    low, high = field_of_view(camera)[1]
    xy, z = points[:, :2], points[:, 2:]
    right, left = xy - high * z - slack * np.hypot(1, high), low * z - xy - slack * np.hypot(1, low)
    return bool((right > 0).all(0).any() or (left > 0).all(0).any())


def polygon_area(corners: ArrayLike) -> float:
    """Return the area of the polygon with the corners (N, 2), one after another, by the shoelace formula."""
    p = np.asarray(corners, np.float64).reshape(-1, 2)
    if not len(p):
        return 0.0
    x, y = (p - p[0]).T  # far from the origin the products would cancel
    return float(abs(x[:-1] @ y[1:] - y[:-1] @ x[1:])) / 2  # the last edge ends at the origin, and spans nothing


def convex_hull_2d(points: ArrayLike) -> Float:
    """Corners (M, 2), counter-clockwise, of the convex hull of points (N, 2).

    Source: A. M. Andrew, "Another efficient algorithm for convex hulls in two dimensions" (1979).
    """
    p = sorted({(x, y) for x, y in _without_inner(np.asarray(points, np.float64)).tolist()})
    if len(p) < 3:
        return np.array(p).reshape(-1, 2)

    def chain(order: list[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for x, y in order:
            while len(kept) > 1:
                (ax, ay), (bx, by) = kept[-2], kept[-1]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                    break
                kept.pop()
            kept.append((x, y))
        return kept[:-1]

    return np.array(chain(p) + chain(p[::-1]))


def _without_inner(points: Float) -> Float:
    """`points` (N, 2) but those that lie well within the polygon of the furthest in some directions, and so not corners
    of the hull's: a few operations on all points at once avoid most of the slow search.

    Source: S. G. Akl and G. T. Toussaint, "A fast convex hull algorithm" (1978).
    """
    if len(points) <= DIRECTIONS:
        return points
    furthest = (TOWARDS @ points.T).argmax(1)
    corners = points[furthest[furthest != _following(furthest)]]  # counter-clockwise
    if len(corners) < 3:
        return points
    (ax, ay), (dx, dy) = corners.T[..., None], (_following(corners) - corners).T[..., None]
    x, y = points.T
    left = dx * (y - ay) - dy * (x - ax)
    outer: Float = points[(left <= ROUNDING * float(np.ptp(points)) ** 2).any(0)]
    return outer


def outline_in_view(camera: Camera, hull: Float) -> Float:
    """Points (N, 2), normalised, one after another around the part of the convex polygon `hull` (M, 2), normalised,
    that is in view: enough that the lens shows straight lines between them.

    The lens is one to one there, so the image of the outline is the outline of the image.
    """
    outline = clip(hull, *field_of_view(camera)[1])
    if not camera.distorted:
        return outline
    if camera.fisheye:
        return _arcs(outline)
    start, along = outline.T[..., None], (_following(outline) - outline).T[..., None]
    return (start + ALONG_EDGE * along).reshape(2, -1).T  # x and y apart: numpy is slow along an axis of two


def _arcs(outline: Float) -> Float:
    """Return points (N, 2), normalised, along the polygon's edges, at equal angles of the rays to them."""
    rays = np.concatenate([outline, np.ones((len(outline), 1))], 1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    start, end = rays[:, None], _following(rays)[:, None]
    turn = np.maximum(2 * np.arcsin(np.clip(np.linalg.norm(end - start, axis=-1, keepdims=True) / 2, 0, 1)), 1e-12)
    share = ALONG_ARC[:, None]
    along = np.sin((1 - share) * turn) * start + np.sin(share * turn) * end
    return np.asarray((along[..., :2] / along[..., 2:]).reshape(-1, 2))


@lru_cache(maxsize=16)
def field_of_view(camera: Camera) -> tuple[tuple[Float, Float], tuple[Float, Float]]:
    """Corners (low, high) of two boxes, in undistorted normalised coordinates: one within the frame, and one that holds
    the frame and 2 px more. The one within has its corners the wrong way round where a lens leaves no room for it."""
    rim = camera.normalised(camera.rim(RIM_SAMPLES))
    top, right, bottom, left = rim.reshape(4, RIM_SAMPLES, 2)
    margin = np.array([PADDING_PX / camera.fx, PADDING_PX / camera.fy])
    low, high = (left[:, 0].max(), top[:, 1].max()), (right[:, 0].min(), bottom[:, 1].min())
    return (np.array(low), np.array(high)), (rim.min(0) - margin, rim.max(0) + margin)


def in_front(hull_cam: Float) -> Float:
    """Corners (M, 3) of the part before the camera, beyond NEAR, of the hull with the corners (N, 3), camera frame: the
    same ones where all of it does."""
    front = hull_cam[:, 2] > NEAR
    if front.all():
        return hull_cam
    before, behind = hull_cam[front, None], hull_cam[~front]
    share = (before[..., 2] - 2 * NEAR) / (before[..., 2] - behind[:, 2])
    crossings = before + share[..., None] * (behind - before)
    return np.concatenate([hull_cam[front], crossings.reshape(-1, 3)])


def clip(polygon: Float, low: Float, high: Float) -> Float:
    """Return the convex polygon (N, 2) cut to the box [low, high]: Sutherland and Hodgman (1974). Further columns are
    interpolated like the first two."""
    if ((polygon[:, :2] >= low) & (polygon[:, :2] <= high)).all():
        return polygon
    for axis in (0, 1):
        for sign, limit in ((1, low[axis]), (-1, -high[axis])):
            if not len(polygon):
                return polygon
            inside = sign * polygon[:, axis] - limit
            within = inside >= 0
            if within.all():
                continue
            following, next_inside = _following(polygon), _following(inside)
            crosses = within != _following(within)
            share = inside / np.where(crosses, inside - next_inside, 1)
            crossings = polygon + share[:, None] * (following - polygon)
            kept = np.stack([within, crosses], -1).ravel()
            polygon = np.stack([polygon, crossings], 1).reshape(-1, polygon.shape[1])[kept]
    return polygon


def _following(rows: NDArray[Any]) -> NDArray[Any]:
    """Return the rows (N, ...) shifted by one: each row's next one, and for the last the first."""
    return np.concatenate([rows[1:], rows[:1]])

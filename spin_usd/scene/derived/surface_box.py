"""The box around the projection of a target's surface: tight and exact, in the frame or not.

A lens is one to one where it can be inverted, so the outermost points of a projected surface lie on edges of its
triangles, or on the rim of the lens's view.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.bounds import NEAR
from spin_usd.geometry.camera import MAX_PIXELS_PER_SIDE, Camera
from spin_usd.geometry.lens import invertible_radius
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.scene import OneBody

BEYOND_PX = MAX_PIXELS_PER_SIDE  # a box ends this far outside the frame: points beside the camera lie at infinity
RIM_STEPS = 1 << 16  # on SPEED+ the box may be 1e-3 px short between two

Meets = Callable[[Float], NDArray[np.bool_]]
"""Whether the rays (x, y, 1) of the coordinates (N, 2) meet the target: (N,)."""

INSIDE = 1 - 1e-9  # of the lens's invertible radius: its rim has no pixel
STEPS = np.linspace(0, 1, 33)  # along an edge
ROUNDS = 4  # each looks between the neighbours of the best step before: at the end to 4e-6 of the edge
CHUNK = 1 << 16  # edges worked on at once
BEND = 0.65  # sqrt(27) / 8
PARALLEL = 1e-12  # a line that is nearer than this to the cone's own slope is taken for one that is flatter
NOTHING = np.array([[np.inf, np.inf], [-np.inf, -np.inf]])
"""The box of no points: any other holds it."""


def surface_box(scene: OneBody, meets: Meets) -> Float | None:
    """Return the box (2, 2), least and greatest u and v in pixels, of the target's part in the lens's view, without
    occlusion; None if there is none.

    The lens's view is in front of the camera and within its invertible radius. For materials that cut holes, whole
    faces count. No side lies further than BEYOND_PX outside the frame.
    """
    camera, mesh = scene.camera, scene.target.mesh
    hull = scene.T_cam_body.points(mesh.hull)
    whole = bool(seen_by_lens(camera, hull).all())
    if whole and not camera.distorted:
        box = box_of_points(camera, hull)
    else:
        box = NOTHING
        for points, edges in _pieces(mesh):
            box = hold(box, box_of_edges(camera, scene.T_cam_body.points(points), edges))
    if not whole:
        rim = rim_of_lens(camera, RIM_STEPS)
        box = hold(box, box_of_points(camera, _on_rays(rim[meets(rim)])))
    return np.clip(box, -BEYOND_PX, _size(camera) + BEYOND_PX) if np.isfinite(box).any() else None


def cut_off(scene: OneBody, box: Float | None) -> bool:
    """Return whether part of the target, whose surface has that box, lies outside the frame or where the lens sees
    nothing."""
    whole = seen_by_lens(scene.camera, scene.T_cam_body.points(scene.target.mesh.hull)).all()
    return box is None or not whole or bool((box[0] < 0).any() or (box[1] > _size(scene.camera)).any())


def _pieces(mesh: Mesh) -> Iterator[tuple[Float, NDArray[np.integer]]]:
    """Yield points (P, 3), body axes, and edges (E, 2) of them: the mesh's own and each instance's."""
    if len(mesh.faces):
        yield mesh.points, mesh.edges
    for each in mesh.instances:
        for place in range(len(each.matrices)):
            yield each.moved(each.shape.points, place), each.shape.edges


def _on_rays(xy: Float) -> Float:
    return np.concatenate([xy, np.ones((len(xy), 1))], axis=1)


def _size(camera: Camera) -> Float:
    return np.array([camera.width, camera.height], np.float64)


def seen_by_lens(camera: Camera, points_cam: Float) -> NDArray[np.bool_]:
    """Return (N,) whether the points (N, 3), camera frame, lie before the camera and where the lens is one to one."""
    x, y, z = points_cam.T
    limit = INSIDE * invertible_radius(camera.distortion)
    return np.asarray((z > NEAR) & (np.hypot(x, y) < limit * np.maximum(z, NEAR)))


def box_of_points(camera: Camera, points_cam: Float) -> Float:
    """Return the box (2, 2), least and greatest u and v in pixels, of the points (N, 3) that the lens sees; NOTHING
    where it sees none."""
    return _box(camera.pixels(_normalised(points_cam[seen_by_lens(camera, points_cam)])))


def box_of_edges(camera: Camera, points_cam: Float, edges: NDArray[np.integer]) -> Float:
    """Return the box (2, 2), least and greatest u and v in pixels, of the straight `edges` (E, 2) between points (P,
    3), camera frame, in the lens's view; NOTHING if none is. It is exact under lens distortion, also beyond the
    frame."""
    box = NOTHING
    for start in range(0, len(edges), CHUNK):
        first, last = points_cam[edges[start : start + CHUNK].T]
        first, last = _seen_part(camera, first, last)
        box = hold(box, hold(_box(camera.pixels(_normalised(first))), _box(camera.pixels(_normalised(last)))))
        if camera.distorted:
            box = _with_bows(camera, first, last, box)
    return box


def hold(box: Float, other: Float) -> Float:
    """Return the smallest box (2, 2) that holds both."""
    return np.stack([np.minimum(box[0], other[0]), np.maximum(box[1], other[1])])


def rim_of_lens(camera: Camera, steps: int) -> Float:
    """Normalised coordinates (steps, 2) around the rim of the lens's view; none without a rim."""
    limit = invertible_radius(camera.distortion)
    if not np.isfinite(limit):
        return np.zeros((0, 2))
    angle = 2 * np.pi * np.arange(steps) / steps
    rim: Float = INSIDE * limit * np.stack([np.cos(angle), np.sin(angle)], -1)
    return rim


def _normalised(points_cam: Float) -> Float:
    xy: Float = points_cam[..., :2] / points_cam[..., 2:]
    return xy


def _box(pixels: Float) -> Float:
    return np.stack([pixels.min(0), pixels.max(0)]) if len(pixels) else NOTHING


def _with_bows(camera: Camera, first: Float, last: Float, box: Float) -> Float:
    """Return the `box` of the ends of segments (N, 3) and (N, 3), grown to contain the bows between them.

    Straight edges bow under distortion: the furthest point of one may lie between its ends. It is sought where the bow
    could reach beyond the box so far.
    """
    if not len(first):
        return box
    ends = camera.pixels(_normalised(np.stack([first, last])))
    reach = _bow(camera, first, last)
    box = box.copy()
    for side, sign in ((0, -1), (1, 1)):
        for axis in (0, 1):
            furthest = (sign * ends[..., axis]).max(0)
            some = furthest + reach[:, axis] > sign * box[side, axis]
            found = _furthest(camera, first[some], last[some], axis, sign)
            box[side, axis] = sign * max(sign * box[side, axis], found)
    return box


def _bow(camera: Camera, first: Float, last: Float) -> Float:
    """Return (N, 2) pixels by which the image of each segment lies beside the straight line between its ends at most:
    an eighth of its length squared times the most that the lens curves it."""
    a, b = _normalised(first), _normalised(last)
    r2 = np.maximum((a * a).sum(1), (b * b).sum(1))
    if camera.fisheye:
        curve = _curve_of_fisheye(np.arctan(np.sqrt(r2)), camera.distortion)
    else:
        k1, k2, p1, p2, k3 = camera.distortion
        curve = np.sqrt(r2) * (6 * abs(k1) + r2 * (20 * abs(k2) + r2 * 42 * abs(k3))) + 8 * (abs(p1) + abs(p2))
    bow: Float = (((b - a) ** 2).sum(1) * curve / 8)[:, None] * np.array([camera.fx, camera.fy])
    return bow


def _curve_of_fisheye(angle: Float, distortion: tuple[float, ...]) -> Float:
    """Return (N,) the most that a fisheye curves straight lines up to the `angle` (N,): twice a bound of the second
    derivative of its distances by the tangent, that of an arcus tangent being BEND at most."""
    curve = np.zeros_like(angle)
    for n, k in zip((1, 3, 5, 7, 9), (1.0, *distortion), strict=True):
        curve += 2 * abs(k) * n * ((n - 1) * angle ** max(n - 2, 0) + BEND * angle ** (n - 1))
    return curve


def _furthest(camera: Camera, first: Float, last: Float, axis: int, sign: int) -> float:
    """Return the greatest of `sign` times a pixel coordinate along segments between (N, 3) and (N, 3)."""
    low, high = np.zeros(len(first)), np.ones(len(first))
    best = np.full(len(first), -np.inf)
    for _ in range(ROUNDS):
        share = low[:, None] + STEPS * (high - low)[:, None]
        points = first[:, None] + share[..., None] * (last - first)[:, None]
        values = sign * camera.pixels(_normalised(points))[..., axis]
        at = values.argmax(1)
        best = np.maximum(best, values.max(1))
        rows = np.arange(len(at))
        low, high = share[rows, np.maximum(at - 1, 0)], share[rows, np.minimum(at + 1, len(STEPS) - 1)]
    return float(best.max(initial=-np.inf))


def _seen_part(camera: Camera, first: Float, last: Float) -> tuple[Float, Float]:
    """Return the ends (M, 3) and (M, 3) of the parts in the lens's view of the segments between `first` and `last` (N,
    3): at most one part of each, since the view is a convex cone."""
    whole = seen_by_lens(camera, first) & seen_by_lens(camera, last)
    if whole.all():
        return first, last
    a, d = first[~whole], last[~whole] - first[~whole]
    low, high = np.zeros(len(a)), np.ones(len(a))
    for enter, leave in (_before_camera(a, d), _within_cone(a, d, INSIDE * invertible_radius(camera.distortion))):
        low, high = np.maximum(low, enter), np.minimum(high, leave)
    some = low < high
    starts, ends = (a[some] + t[some, None] * d[some] for t in (low, high))
    return np.concatenate([first[whole], starts]), np.concatenate([last[whole], ends])


def _before_camera(a: Float, d: Float) -> tuple[Float, Float]:
    """Return from where to where (N,) the lines a + t d (N, 3) are further than NEAR before the camera."""
    crossing = (2 * NEAR - a[:, 2]) / np.where(d[:, 2] == 0, 1, d[:, 2])
    never = (d[:, 2] == 0) & (a[:, 2] <= NEAR)
    enter = np.where(d[:, 2] > 0, crossing, np.where(never, np.inf, -np.inf))
    return enter, np.where(d[:, 2] < 0, crossing, np.inf)


def _within_cone(a: Float, d: Float, slope: float) -> tuple[Float, Float]:
    """Return from where to where (N,) the lines a + t d (N, 3) are within the cone |xy| < slope * z, whose other half,
    behind the camera, is left to `_before_camera`."""
    if not np.isfinite(slope):
        return np.full(len(a), -np.inf), np.full(len(a), np.inf)
    signs = np.array([-1, -1, slope * slope])  # within: signs * p * p > 0
    square, half, constant = (signs * d * d).sum(1), (signs * a * d).sum(1), (signs * a * a).sum(1)
    size = (d * d).sum(1)
    square = np.where(np.abs(square) <= PARALLEL * size, -PARALLEL * np.maximum(size, PARALLEL), square)
    inside = half * half - square * constant
    root = np.sqrt(np.maximum(inside, 0))
    one, other = (-half - root) / square, (-half + root) / square
    steep = square > 0  # such a line enters one half of the cone and leaves the other
    enter = np.where(steep, np.where(d[:, 2] > 0, other, -np.inf), np.where(inside > 0, other, np.inf))
    return enter, np.where(steep, np.where(d[:, 2] > 0, np.inf, one), one)

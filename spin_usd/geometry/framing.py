"""The place of a body in a frame: in it, cut off by it, outside it, behind the camera, or around the camera.

Many poses at once: a ball around the body decides most of them, its corners most of the rest, and the outlines of the
few that are near the frame's edge decide those.
"""

from collections.abc import Iterator
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.bounds import (
    NEAR,
    clip,
    convex_hull_2d,
    field_of_view,
    in_front,
    outline_in_view,
    outline_of,
    polygon_area,
)
from spin_usd.geometry.camera import Camera

CHUNK = 1 << 18  # corners worked on at once: their temporaries fit a core's cache
UNDECIDED = 255


class Framing(IntEnum):
    """The place of a body in a frame. WHOLE: all of it. CUT_OFF: some of it. OUTSIDE: none, though not all of it is
    BEHIND the camera. CAMERA_INSIDE: the camera is inside the body's bounding box, whatever the frame shows."""

    WHOLE = 0
    CUT_OFF = 1
    OUTSIDE = 2
    BEHIND = 3
    CAMERA_INSIDE = 4


def framings(camera: Camera, hull: Float, rotations: Float, translations: Float) -> NDArray[np.uint8]:
    """Return the Framing (M,) of the body whose convex hull has the corners `hull` (N, 3), body frame, metres, at the
    poses T_cam_body of `rotations` (M, 3, 3) and `translations` (M, 3), metres."""
    found = _by_ball(camera, hull, rotations, translations)
    found[around(hull, rotations, translations)] = Framing.CAMERA_INSIDE
    open_ones = np.flatnonzero(found == UNDECIDED)
    step = max(CHUNK // len(hull), 1)
    for start in range(0, len(open_ones), step):
        some = open_ones[start : start + step]
        found[some] = _by_corners(camera, hull @ rotations[some].mT + translations[some, None])
    return found


def around(hull: Float, rotations: Float, translations: Float) -> NDArray[np.bool_]:
    """Return (M,) whether the camera is inside the bounding box of the corners `hull` (N, 3); poses as in
    `framings`."""
    eyes = -np.einsum("mji,mj->mi", rotations, translations)
    return np.asarray(((eyes > hull.min(0)) & (eyes < hull.max(0))).all(1))


def _by_ball(camera: Camera, hull: Float, rotations: Float, translations: Float) -> NDArray[np.uint8]:
    """Return the framings (M,) that the ball around the body decides; UNDECIDED for the others."""
    centre = (hull.min(0) + hull.max(0)) / 2
    radius = float(np.linalg.norm(hull - centre, axis=1).max())
    place = rotations @ centre + translations
    found = np.full(len(place), UNDECIDED, np.uint8)
    found[place[:, 2] <= -radius] = Framing.BEHIND
    inner, outer = _sides(camera)
    whole = (place[:, 2] > radius + NEAR) & (place @ inner.T >= radius).all(1)
    found[whole] = Framing.WHOLE
    found[(place[:, 2] > radius) & (place @ outer.T < -radius).any(1)] = Framing.OUTSIDE
    return found


def _by_corners(camera: Camera, hull_cam: Float) -> list[int]:
    """Return the framing of each of the hulls (M, N, 3), camera frame."""
    inner, outer = _sides(camera)
    front = hull_cam[..., 2] > NEAR
    seen = front & (hull_cam @ inner.T >= 0).all(-1)
    beyond = hull_cam @ outer.T < 0
    some, hidden = seen.any(1), (~front | beyond.any(-1)).any(1)
    decided = np.select(
        [~front.any(1), seen.all(1), some & hidden, beyond.all(1).any(-1)],
        [Framing.BEHIND, Framing.WHOLE, Framing.CUT_OFF, Framing.OUTSIDE],
        UNDECIDED,
    )
    return [
        _by_outline(camera, corners) if framing == UNDECIDED else int(framing)
        for framing, corners in zip(decided, hull_cam, strict=True)
    ]


def _by_outline(camera: Camera, hull_cam: Float) -> Framing:
    """Return the framing of one hull (N, 3), camera frame, that is partly before the camera."""
    corners = in_front(hull_cam)
    outline = outline_of(camera, corners)
    size = np.array([camera.width, camera.height], np.float64)
    if outline is None or not len(clip(outline, np.zeros(2), size)):
        return Framing.OUTSIDE
    shown = len(corners) == len(hull_cam) and bool(((outline >= 0) & (outline <= size)).all())
    return Framing.WHOLE if shown else Framing.CUT_OFF


def _sides(camera: Camera) -> tuple[Float, Float]:
    """Unit normals (4, 3), pointing inwards, of the planes through the camera that bound two pyramids: one within what
    the frame shows, and one around it."""
    inner, outer = field_of_view(camera)
    return _pyramid(*inner), _pyramid(*outer)


def _pyramid(low: Float, high: Float) -> Float:
    planes = np.array([[1, 0, -low[0]], [-1, 0, high[0]], [0, 1, -low[1]], [0, -1, high[1]]])
    return np.asarray(planes / np.linalg.norm(planes, axis=1, keepdims=True))


def framed_shares(camera: Camera, hull: Float, rotations: Float, translations: Float) -> Iterator[float]:
    """Yield for each pose the share, 0 to 1, of the outline of a convex hull that lies in the frame; 0 where the camera
    is inside. Anything not requested costs little.

    hull: corners (N, 3), body frame, metres; seen at the poses T_cam_body of `rotations` (M, 3, 3) and `translations`
    (M, 3). Areas are those of the image plane without distortion, for there the outline has an area outside the frame
    too; the frame's edge in it is where the lens has it.
    """
    for i, framing in enumerate(framings(camera, hull, rotations, translations)):
        if framing == Framing.CUT_OFF:
            yield _share(camera, in_front(hull @ rotations[i].T + translations[i]))
        else:
            yield float(framing == Framing.WHOLE)


def _share(camera: Camera, hull_cam: Float) -> float:
    """Return the share of the hull (N, 3), camera frame, all of it before the camera."""
    outline = convex_hull_2d(hull_cam[:, :2] / hull_cam[:, 2:])
    seen = outline_in_view(camera, outline)
    size = np.array([camera.width, camera.height], np.float64)
    shown = clip(np.concatenate([camera.pixels(seen), seen], 1), np.zeros(2), size)[:, 2:]
    return polygon_area(shown) / polygon_area(outline)

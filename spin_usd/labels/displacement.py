"""Displacement: the distance, in pixels, from each pixel to its surface point in another view of the scene: the next
frame, or another camera.

The point is fixed to its face, follows the other view's pose and shape, and is projected through that view's lens. A
ray from the point to the other camera finds whether it is hidden there.
"""

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.triangles import unit_normals
from spin_usd.labels.labelled_picture import LabelledPicture, OtherView
from spin_usd.scene.derived.content_keys import placed
from spin_usd.scene.derived.faces import corners_of
from spin_usd.scene.derived.shadows import RayCaster, in_shadow, lifted
from spin_usd.scene.derived.surface import Rows, Surface, weights_at
from spin_usd.scene.scene import OneBody, Scene

HOLDS = "is 1 = seen there, 2 = hidden, 3 = outside the frame, 4 = where the lens sees nothing (R and G are 0)"
OFF_PX = 1e-3  # float32 of the dense pose, and of displacements over a few thousand pixels


class PointState(IntEnum):
    """State of a point in the other view."""

    SEEN = 1
    HIDDEN = 2
    OUTSIDE = 3
    UNSEEABLE = 4


def displacement(scene: Scene, surface: Surface, other: Scene | None) -> NDArray[np.float32]:
    """Return (H, W, 3) float32: pixels to the right and down from here to the `other` view, 0 outside its lens's view,
    and the PointState; 0, 0, 0 for no surface, where the other view lacks its body, and everywhere without another
    view."""

    def moves(one: OneBody, rows: Rows) -> Float | float:
        there = _same_body(one, other) if other else None
        return _moves(surface, rows, one, other, there) if other and there else 0.0

    return surface.image_of(moves, (3,), np.float32)


def decided_by(scene: Scene, other: Scene | None) -> Any:
    """Return the inputs of the places of the points of `scene` in the `other` view: its camera and bodies, and the
    correspondence of bodies."""
    if other is None:
        return None
    paths = [body.target.path for body in other.bodies]
    same = [paths.index(body.target.path) if body.target.path in paths else None for body in scene.bodies]
    return [other.camera, [placed(body) for body in other.bodies], same]


def largest_error(picture: LabelledPicture, found: NDArray[Any], view: OtherView) -> float:
    """Return the largest error, in pixels, of the displacements `found` (H, W, 3) against the dense pose's points in
    the other `view`; 0 without such a label."""
    points = picture.points_in(view.poses)
    if points is None or picture.target_pixels is None:
        return 0.0
    rows, columns = picture.target_pixels
    moves = found[rows, columns].astype(np.float64)
    off = np.stack([columns + 0.5, rows + 0.5], -1) + moves[:, :2] - view.camera.project(points)
    led = (moves[:, 2] > 0) & (moves[:, 2] != PointState.UNSEEABLE)
    return float(np.abs(off[led]).max(initial=0))


def _same_body(one: OneBody, other: Scene) -> OneBody | None:
    """Return the scene of the other view with the body alone that is alone in `one`, with as many faces; None where
    that view has none."""
    path, count = one.target.path, one.target.mesh.count
    same = (each for each in other.one_body_scenes if (each.target.path, each.target.mesh.count) == (path, count))
    return next(same, None)


def _moves(surface: Surface, rows: Rows, one: OneBody, other: Scene, there: OneBody) -> Float:
    """Return (M, 3) the label's values for the points of the surface that belong to the body alone in `one`."""
    body, normals = _moved(surface, rows, one, there)
    uv = there.camera.project(there.T_cam_body.points(body))
    u, v = uv.T
    seeable = np.isfinite(u)
    here = np.stack([surface.columns[rows] + 0.5, surface.rows[rows] + 0.5], -1)
    states = np.where(seeable, PointState.OUTSIDE, PointState.UNSEEABLE)
    inside = np.flatnonzero((u >= 0) & (v >= 0) & (u < there.camera.width) & (v < there.camera.height))
    hidden = _hidden(other, there, body[inside], normals[inside], surface.rays)
    states[inside] = np.where(hidden, PointState.HIDDEN, PointState.SEEN)
    return np.column_stack([np.where(seeable[:, None], uv - here, 0), states])


def _moved(surface: Surface, rows: Rows, one: OneBody, there: OneBody) -> tuple[Float, Float]:
    """Return the points and their normals (M, 3) in the other view, body axes: at the same places of their faces."""
    face, body = surface.face[rows], surface.body[rows]
    if one.target is there.target:
        return body, surface.normals[rows]
    corners = corners_of(there.target.mesh, face)
    return (weights_at(one.target.mesh, face, body)[..., None] * corners).sum(1), unit_normals(corners)


def _hidden(other: Scene, there: OneBody, body: Float, normals: Float, caster: RayCaster) -> NDArray[np.bool_]:
    """Return (N,) whether something stands between the points of the body alone in `there` and the other camera."""
    to_eye = there.T_cam_body.inverse().translation - body
    distance = np.sqrt(np.einsum("ni,ni->n", to_eye, to_eye))
    side = np.sign(np.einsum("ni,ni->n", normals, to_eye))  # of a sheet, that from which the other camera sees it
    above = lifted(there.target.mesh, body, side[:, None] * normals)
    return in_shadow(other, there, above, to_eye / distance[:, None], caster, distance)

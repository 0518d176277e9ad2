"""Flow: how far, in pixels, the surface point that each pixel shows moves until the next frame.

The point is fixed to its face, goes where the next frame's pose and shape put that, and is projected through the next
frame's lens. What it meets there is asked of a ray from the point to the next frame's camera.
"""

from collections.abc import Iterator
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.triangles import unit_normals
from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_motion
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.content_keys import placed
from spin_usd.scene.derived.faces import corners_of
from spin_usd.scene.derived.shadows import RayCaster, in_shadow, lifted
from spin_usd.scene.derived.surface import Rows, Surface, weights_at
from spin_usd.scene.model import Scene

OFF_PX = 1e-3  # float32 of the dense pose, and of flow over a few thousand pixels


class NextState(IntEnum):
    """What becomes of a point in the next frame."""

    SEEN = 1
    HIDDEN = 2
    OUTSIDE = 3
    UNSEEABLE = 4


def flow(scene: Scene, surface: Surface) -> NDArray[np.float32]:
    """Return (H, W, 3) float32: pixels to the right and down, 0 where the next camera's lens sees no such point, and
    the NextState; 0, 0, 0 where there is no surface, where the next frame lacks its body, and all over the last
    frame."""
    following = scene.next_frame

    def moves(one: Scene, rows: Rows) -> Float | float:
        there = _same_body(one, following) if following else None
        return _moves(surface, rows, one, following, there) if following and there else 0.0

    return surface.image_of(moves, (3,), np.float32)


def _same_body(one: Scene, following: Scene) -> Scene | None:
    """Return the scene of the next frame with the body alone that is alone in `one`, with as many faces; None where
    that frame has none."""
    path, count = one.target.path, one.target.mesh.count
    same = (each for each in following.one_body_scenes if (each.target.path, each.target.mesh.count) == (path, count))
    return next(same, None)


def _moves(surface: Surface, rows: Rows, one: Scene, following: Scene, there: Scene) -> Float:
    """Return (M, 3) what the label has for those points of the surface that are of the body alone in `one`."""
    body, normals = _moved(surface, rows, one, there)
    uv = there.camera.project(there.T_cam_body.points(body))
    u, v = uv.T
    seeable = np.isfinite(u)
    here = np.stack([surface.columns[rows] + 0.5, surface.rows[rows] + 0.5], -1)
    states = np.where(seeable, NextState.OUTSIDE, NextState.UNSEEABLE)
    inside = np.flatnonzero((u >= 0) & (v >= 0) & (u < there.camera.width) & (v < there.camera.height))
    hidden = _hidden(following, there, body[inside], normals[inside], surface.rays)
    states[inside] = np.where(hidden, NextState.HIDDEN, NextState.SEEN)
    return np.column_stack([np.where(seeable[:, None], uv - here, 0), states])


def _moved(surface: Surface, rows: Rows, one: Scene, there: Scene) -> tuple[Float, Float]:
    """Return the points and their normals (M, 3) in the next frame, body axes: at the same places of their faces."""
    face, body = surface.face[rows], surface.body[rows]
    if one.target is there.target:
        return body, surface.normals[rows]
    corners = corners_of(there.target.mesh, face)
    return (weights_at(one.target.mesh, face, body)[..., None] * corners).sum(1), unit_normals(corners)


def _hidden(following: Scene, there: Scene, body: Float, normals: Float, caster: RayCaster) -> NDArray[np.bool_]:
    """Return (N,) whether something stands between the points of the body alone in `there` and the next camera."""
    to_eye = there.T_cam_body.inverse().translation - body
    distance = np.sqrt(np.einsum("ni,ni->n", to_eye, to_eye))
    side = np.sign(np.einsum("ni,ni->n", normals, to_eye))  # of a sheet, that from which the next camera sees it
    above = lifted(there.target.mesh, body, side[:, None] * normals)
    return in_shadow(following, there, above, to_eye / distance[:, None], caster, distance)


def decided_by(scene: Scene) -> Any:
    """Return what decides where the points go: the next frame's camera and bodies, and which body is which."""
    following = scene.next_frame
    if following is None:
        return None
    paths = [body.target.path for body in following.bodies]
    same = [paths.index(body.target.path) if body.target.path in paths else None for body in scene.bodies]
    return [following.camera, [placed(body) for body in following.bodies], same]


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Flow takes each pixel to where the dense pose's point is in the next frame."""
    found, camera = picture.arrays["flow"], picture.next_camera
    if camera is None:
        if found.any():
            yield LabelFault(code="flow", message="flow is not 0 in a picture whose record names no next frame")
        return
    points = picture.points_in(picture.next_poses)
    if points is None or picture.target_pixels is None:
        return
    rows, columns = picture.target_pixels
    moves = found[rows, columns].astype(np.float64)
    off = np.stack([columns + 0.5, rows + 0.5], -1) + moves[:, :2] - camera.project(points)
    led = (moves[:, 2] > 0) & (moves[:, 2] != NextState.UNSEEABLE)
    worst = np.abs(off[led]).max(initial=0)
    if not worst <= OFF_PX:
        yield LabelFault(code="flow", message=f"flow ends {worst:.3g} px beside the dense pose's points")


FLOW = Label(
    name="flow",
    make=flow,
    decided_by=decided_by,
    takes_next_frame=True,
    channels=Channels(
        meaning="how far the surface point moves until the next frame, pixels right and down, and what becomes of it: "
        "float32 channels R, G, B; B is 1 = seen there, 2 = hidden, 3 = outside the frame, 4 = where the lens sees "
        "nothing (R and G are 0); 0 = nothing, and all over the last frame",
        dtype="float32",
        holds={"R": "right", "G": "down", "B": "what becomes of the point"},
        unit="px",
    ),
    suffix=".exr",
    usd_type="float3",
    file_bytes=4.0,
    target_s=3.5e-07,
    preview=by_motion,
    faults=faults,
)

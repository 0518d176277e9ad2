"""The box around the projection of a target's surface: tight and exact, in the frame or not.

A lens is one to one where it can be inverted, so the outermost points of what it makes of a surface lie on edges of its
triangles, or on the rim of what the lens sees.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.camera import MAX_PIXELS_PER_SIDE, Camera
from spin_usd.scene.derived.projected_box import NOTHING, box_of_edges, box_of_points, hold, rim_of_lens, seen_by_lens
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.model import Scene

BEYOND_PX = MAX_PIXELS_PER_SIDE  # a box ends so far outside the frame: what is beside the camera lies at infinity
RIM_STEPS = 1 << 16  # on SPEED+ the box may be 1e-3 px short between two

Meets = Callable[[Float], NDArray[np.bool_]]
"""Whether the rays (x, y, 1) of the coordinates (N, 2) meet the target: (N,)."""


def surface_box(scene: Scene, meets: Meets) -> Float | None:
    """Return the box (2, 2), least and greatest u and v in pixels, of all that the lens sees of the target, as if
    nothing else were there; None where it sees nothing.

    The lens sees what is before the camera and within its invertible radius. Where a material cuts holes, its whole
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


def cut_off(scene: Scene, box: Float | None) -> bool:
    """Return whether part of the target, whose surface has that box, lies outside the frame or where the lens sees
    nothing."""
    whole = seen_by_lens(scene.camera, scene.T_cam_body.points(scene.target.mesh.hull)).all()
    return box is None or not whole or bool((box[0] < 0).any() or (box[1] > _size(scene.camera)).any())


def _pieces(mesh: Mesh) -> Iterator[tuple[Float, NDArray[np.integer]]]:
    """Yield points (P, 3), body axes, and edges (E, 2) of them: the mesh's own and those of each place."""
    if len(mesh.faces):
        yield mesh.points, mesh.edges
    for each in mesh.instances:
        for place in range(len(each.matrices)):
            yield each.moved(each.shape.points, place), each.shape.edges


def _on_rays(xy: Float) -> Float:
    return np.concatenate([xy, np.ones((len(xy), 1))], axis=1)


def _size(camera: Camera) -> Float:
    return np.array([camera.width, camera.height], np.float64)

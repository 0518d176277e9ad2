"""Shadows: obstacles between points of a body's surface and a place."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.scene.light import Links
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.scene import OneBody, Scene
from spin_usd.scene.target import Target

LIFT = 1e-5  # of the target's radius: rays from the surface start this far above it; float32 is good to 1e-7 there


class RayCaster(Protocol):
    """A caster of rays at targets; renderers/raycast has one."""

    def cast(self, scene: Scene, xy: Float) -> NDArray[np.int32]:
        """Return the first face (N,) on the camera's rays (x, y, 1) of `xy` (N, 2); -1 for none."""
        ...

    def shadowed(
        self, target: Target, body: Float, to_light: Float, distance: Float | None = None, blockers: Links = None
    ) -> NDArray[np.bool_]:
        """Return (N,) True where the target stands between the `body` points (N, 3) and a place towards `to_light` (3,)
        or (N, 3), unit, body axes, `distance` (N,) metres away, else far. Only the face groups `blockers` block, where
        given."""
        ...


def lifted(mesh: Mesh, body: Float, normals: Float) -> Float:
    """Return (N, 3) the `body` points a little above the surface whose unit `normals` (N, 3) are given: where rays that
    leave it start."""
    return body + LIFT * mesh.radius * normals


def in_shadow(
    scene: Scene,
    one: OneBody,
    body: Float,
    to_light: Float,
    caster: RayCaster,
    distance: Float | None = None,
    blockers: Links = None,
) -> NDArray[np.bool_]:
    """Return (N,) True where any body of the scene stands between the points `body` (N, 3) of the body alone in `one`
    and a light, as RayCaster.shadowed has it of one."""
    dark = caster.shadowed(one.target, body, to_light, distance, blockers)
    for other in scene.one_body_scenes:
        if other is not one:
            T = other.T_cam_body.inverse() @ one.T_cam_body
            dark |= caster.shadowed(other.target, T.points(body), T.directions(to_light), distance, blockers)
    return dark

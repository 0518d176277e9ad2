"""The approximate number of pixels that targets cover in a picture, without rendering it."""

from dataclasses import replace

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.directions import half_sphere
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.scene import OneBody, Scene

SIDES = 128  # directions of view, some 13 degrees apart
SIDE_PX = 64  # side of the square picture of a view
FAR = 100.0  # radii away, where lines of sight are all but parallel
SHARPNESS = 60  # power of the cosine by which the sides near a line of sight count; falls to half at 9 degrees
FAINTEST = 1e-3  # of the nearest side's weight: sides beyond some 27 degrees do not count, and change 0.03 %


class Coverage:
    """Estimates the pixels that targets cover, by the share of its outline that a target fills, seen from any side.

    That share is computed once per mesh for each side of a half sphere that lies near a line of sight (front and back
    fill the same, seen from far away), and kept by mesh and holes; most pictures then cost a few operations. Over poses
    of Tango as in SPEED+ the error is 2 %, at most 5 %.
    """

    def __init__(self) -> None:
        self._sides, self._caster = half_sphere(SIDES), EmbreeCaster()
        self._filled: dict[tuple[str, str], Float] = {}  # NaN for a side not needed yet

    def target_pixels(self, scene: Scene) -> float:
        """Return the approximate number of pixels that the bodies of `scene` cover."""
        return min(sum(map(self._pixels, scene.one_body_scenes)), scene.outline_pixels)

    def _pixels(self, scene: OneBody) -> float:
        """Return the approximate number of pixels that the target of `scene` covers alone."""
        target, pose = scene.target, scene.T_cam_body
        key = target.mesh.key, target.cut_out_key
        known = self._filled.setdefault(key, np.full(SIDES, np.nan))
        towards = pose.rotation.T @ pose.points(target.mesh.centre)
        along = (self._sides @ towards / max(float(np.linalg.norm(towards)), 1e-300)) ** SHARPNESS
        near = along > FAINTEST * along.max()
        unknown = np.flatnonzero(near & np.isnan(known))  # few pictures need few sides
        known[unknown] = [filled(scene, side, self._caster) for side in self._sides[unknown]]
        total = float(along[near].sum())
        return scene.outline_pixels * (float(along[near] @ known[near]) / total if total else 1.0)


def filled(scene: OneBody, side: Float, caster: EmbreeCaster) -> float:
    """Return the share of its outline that the target fills, seen from afar along `side` (3,), unit, body axes."""
    mesh = scene.target.mesh
    across = np.cross(side, np.eye(3)[np.abs(side).argmin()])
    across /= np.linalg.norm(across)
    rotation = np.stack([across, np.cross(side, across), side])
    place = FAR * max(mesh.radius, 1e-300) * np.array([0, 0, 1]) - rotation @ mesh.centre
    pose = Transform(to=scene.T_cam_body.to, of=scene.T_cam_body.of, rotation=rotation, translation=place)
    middle = SIDE_PX / 2
    camera = Camera(width=SIDE_PX, height=SIDE_PX, fx=middle * FAR, fy=middle * FAR, cx=middle, cy=middle)
    body = replace(scene.bodies[0].still, T_cam_body=pose)
    seen = replace(scene, camera=camera, bodies=(body,), thin_lens=None, shutter=None)
    pixels = np.count_nonzero(caster.meets(seen, camera.centres(seen.region).reshape(-1, 2)))
    return min(pixels / outline, 1.0) if (outline := seen.outline_pixels) else 1.0

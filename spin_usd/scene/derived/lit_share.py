"""The share of the visible surface that the Sun lights, from where Sun and camera are, before rendering."""

from collections.abc import Sequence

import numpy as np

from spin_usd.arrays import Float
from spin_usd.geometry.facing import facing_share
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.light import DistantLight, DomeLight
from spin_usd.scene.model import Scene

TINY = np.finfo(np.float64).tiny
UNLIT_SHARE = 0.1  # of what the camera sees: where less than that faces the Sun a renderer finds 0 to 17 % of it lit

Suns = tuple[tuple[float, float, float], ...] | None
"""Unit directions, camera frame, to the distant lights that reach a target, which no other light does; none of them in
the dark. None where others light it too: lamps, domes, what shines itself."""


def suns_of(scene: Scene) -> Suns:
    """Return the suns of one picture. The light of planets does not count: it reaches what the Sun lights, and less
    brightly."""
    groups = LightGroups.of(scene)
    lights = [scene.lights[i] for i in groups.placed]
    suns = [light for light in lights if isinstance(light, DistantLight)]
    domes = any(isinstance(light, DomeLight) and any(light.radiance) for light in scene.lights)
    if groups.emission or domes or len(suns) < len(lights):
        return None
    return tuple((-x, -y, -z) for x, y, z in (sun.direction_cam for sun in suns))


def lit_shares(axes: Float, centres: Float, rotations: Float, suns: Sequence[Suns]) -> Float:
    """Return (M,) the share of what each picture shows of a surface that faces a Sun, 1 where other lights reach it: of
    the surface with the `axes` (A, 3) (geometry.facing), around `centres` (M, 3), camera frame, metres, rotated by
    `rotations` (M, 3, 3) from body to camera."""
    shares = np.array([float(each is None) for each in suns])
    picture = [i for i, each in enumerate(suns) for _ in each or ()]
    if picture:
        away = centres[picture] / np.maximum(np.linalg.norm(centres[picture], axis=1, keepdims=True), TINY)
        to_light = np.array([sun for each in suns for sun in each or ()])
        body = [np.einsum("mji,mj->mi", rotations[picture], towards) for towards in (-away, to_light)]
        np.maximum.at(shares, picture, facing_share(axes, *body))
    return shares

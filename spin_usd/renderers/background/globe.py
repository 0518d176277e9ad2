"""The points where rays meet an ellipsoid, in double precision."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spin_usd.arrays import Float
from spin_usd.renderers.background.latlong import Float32
from spin_usd.scene.environment import Planet

AIR_HEIGHTS = 10.0  # scale heights above which there is no air to see
MIN_SPAN = np.float32(1e-12)
BEHIND = np.float32(1e3)  # radii: there is no air as high


@dataclass(frozen=True, kw_only=True, eq=False)
class Rays:
    """N rays in the camera frame: components x, y, z (N,), or one number z, float64, and their length (N,); angle (N,):
    the angle that each ray's pixel spans, radians."""

    x: Float
    y: Float
    z: Float | float
    length: Float32
    angle: Float32


@dataclass(frozen=True, kw_only=True, eq=False)
class Meeting:
    """The points where rays meet a planet, or come nearest to it; lengths in its mean radius, float32 (N,).

    covered: share of the pixel that the planet fills · normal: x, y, z in planet axes, outward · height above the
    surface · toward: cosine of the angle between the normal and the way back · footprint: the length that the pixel
    spans on the surface.
    """

    covered: Float32
    normal: list[Float32]
    height: Float32
    toward: Float32
    footprint: Float32


@dataclass(frozen=True, kw_only=True, eq=False)
class Globe:
    """`planet` seen from `eye` (3,), camera frame, metres."""

    planet: Planet
    eye: Float

    @cached_property
    def centre(self) -> Float:
        """(3,) the planet's centre from the eye, camera axes, metres."""
        return self.planet.T_cam_planet.translation - self.eye

    @cached_property
    def distance(self) -> float:
        """The distance from the eye to the centre, metres."""
        return float(np.linalg.norm(self.centre))

    @cached_property
    def angular_radius_sine(self) -> float:
        """Sine of the angular radius within which it and its air lie."""
        planet = self.planet
        air = AIR_HEIGHTS * planet.atmosphere if any(planet.haze) else 0.0
        return min((max(planet.radii) + air) / self.distance, 1.0)

    def touches(self, meeting: Meeting) -> bool:
        """Return whether any of the rays meets the planet or its air."""
        planet = self.planet
        air = AIR_HEIGHTS * planet.atmosphere / float(np.mean(planet.radii)) if any(planet.haze) else 0.0
        return bool(meeting.covered.any() or meeting.height.min() < air)

    def meet(self, rays: Rays) -> Meeting:
        """Return the points where the rays meet the planet; nothing is covered behind the eye."""
        radii, turn = np.array(self.planet.radii), self.planet.T_cam_planet.rotation.T
        o = turn @ -self.centre / radii  # the planet is the unit sphere
        d = [m[0] * rays.x + m[1] * rays.y + m[2] * rays.z for m in turn / radii[:, None]]
        dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        od = o[0] * d[0] + o[1] * d[1] + o[2] * d[2]
        inside = od * od / dd - (o @ o - 1)  # 1 - (distance of the ray from the centre)^2
        way = (-od - np.sqrt(np.maximum(inside, 0) * dd)) / dd
        p = [(i + way * j).astype(np.float32) for i, j in zip(o, d, strict=True)]
        span = way.astype(np.float32) * rays.angle * rays.length / np.float32(radii.mean())
        gap = (inside / (1 + np.sqrt(np.maximum(1 - inside, 0)))).astype(np.float32)  # 1 - that distance
        covered = np.clip(gap / np.maximum(span, MIN_SPAN) + np.float32(0.5), 0, 1)
        covered[od >= 0] = 0
        normal = _unit([c / np.float32(r) for c, r in zip(p, radii / radii.mean(), strict=True)])
        back = [n * i.astype(np.float32) * np.float32(-r) for n, i, r in zip(normal, d, radii, strict=True)]
        toward = np.maximum((back[0] + back[1] + back[2]) / rays.length, 0)
        return Meeting(
            covered=covered,
            normal=normal,
            height=np.where(od < 0, np.maximum(-gap, 0), BEHIND),
            toward=toward,
            footprint=span / np.maximum(toward, np.float32(0.02)),
        )


def _unit(v: list[Float32]) -> list[Float32]:
    scale = 1 / np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return [c * scale for c in v]

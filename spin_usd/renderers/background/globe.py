"""A planet as rays meet it: the points of its ellipsoid, in double precision, and its air."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.lens import distortion_jacobian
from spin_usd.renderers.background.elementary import Float32, exp, length, rotated
from spin_usd.scene.environment import Planet
from spin_usd.scene.texture import Image

AIR_HEIGHTS = 10.0  # scale heights above which air is invisible
MIN_SPAN = np.float32(1e-12)
MIN_TOWARD = np.float32(0.02)
MIN_MASS = np.float32(1e-20)
BEHIND = np.float32(1e3)  # radii: there is no air as high


@dataclass(frozen=True, kw_only=True, eq=False)
class Air:
    """Air that scatters light and absorbs none: an exponential atmosphere, Rayleigh's law, a curved surface.

    A ray's way through it counts in vertical thicknesses, its air mass: 1 / cos(zenith angle) where the ground is flat
    enough, and sqrt(pi R / 2H) along the horizon (S. Chapman, 1931); between them 1 / sqrt(cos^2 + 2H / pi R).
    """

    scale_height: float
    """In planet radii."""
    depth: tuple[float, float, float]
    """The optical depth straight down, R, G, B."""

    def passed(self, mass: Float32, direct: Float32, channel: int) -> Float32:
        """Return the share of light along a ray of that air mass that reaches the ground, or leaves from there to
        space, `direct` of it unscattered. About half of the scattered light goes on forward.

        Source: two streams of light, W. E. Meador and W. R. Weaver, J. Atmos. Sci. 37 (1980), Eddington's method, for
        scattering without absorption and asymmetry.
        """
        back = (np.float32(0.5) - np.float32(0.75) / np.maximum(mass, MIN_MASS)) * (1 - direct)
        return np.asarray((1 - back) * np.float32(1 / (1 + 0.75 * self.depth[channel])))

    @property
    def returned(self) -> list[np.float32]:
        """The share of diffuse light from the ground, R, G, B, that comes back to it; same source."""
        return [np.float32(0.75 * depth / (1 + 0.75 * depth)) for depth in self.depth]

    @property
    def multiple_scattering(self) -> list[np.float32]:
        """The light that leaves the air upward, R, G, B, over the part of it that was scattered once: 1 + 2t / (1 + t)
        at optical depth t. Fitted to traced photons: within 6 % of the flux, and 15 % of the radiance straight up,
        for t up to 0.5 and the Sun 9 to 90 degrees high."""
        return [np.float32((1 + 3 * depth) / (1 + depth)) for depth in self.depth]

    def mass(self, cosine: Float32) -> Float32:
        """Return (N,) air mass from the surface to space, at the `cosine` of the zenith angle, 0 for one below the
        horizon."""
        bent = np.float32(2 * self.scale_height / np.pi)
        return np.asarray(1 / np.sqrt(np.square(np.maximum(cosine, 0)) + bent))

    @property
    def limb_mass(self) -> float:
        """The air mass of a ray from space to space along the horizon."""
        return float(np.sqrt(2 * np.pi / self.scale_height))

    def thinned(self, height: Float32) -> Float32:
        """Return (N,) density at `height` in planet radii, over that at the surface."""
        return exp(height * np.float32(-1 / self.scale_height))

    def twilight(self, cosine: Float32) -> Float32:
        """Return (N,) share of the air that the Sun still reaches where it stands below the horizon by -`cosine`
        radians: the share above the planet's shadow."""
        return exp(np.square(np.minimum(cosine, 0)) * np.float32(-0.5 / self.scale_height))


def rayleigh(cosine: Float32) -> Float32:
    """Phase function over 4 pi, 1/sr, of the angle between the light's way before and after."""
    return (1 + cosine * cosine) * np.float32(3 / (16 * np.pi))


@dataclass(frozen=True, kw_only=True, eq=False)
class Rays:
    """Rays in the camera frame, N of them or an array of any shape; x, y and z are float64."""

    x: Float
    y: Float
    z: Float | float
    """One number where all rays have the same."""
    length: Float32
    angle: Float32
    """Angle that each ray's pixel spans, radians."""

    @classmethod
    def through(cls, camera: Camera, xy: Float) -> "Rays":
        """Return the rays of the camera's pixels whose centres have the undistorted normalised coordinates (2, N)."""
        x, y = xy
        length = np.sqrt((1 + x * x + y * y).astype(np.float32))
        # What a pixel spans, as if the lens bent nothing: the root of its solid angle.
        angle = 1 / (length * np.sqrt(length) * np.float32(np.sqrt(camera.fx * camera.fy)))
        if camera.fisheye:
            stretch = np.linalg.det(distortion_jacobian(np.stack([x, y], -1), camera.distortion))
            angle = angle / np.sqrt(np.abs(stretch))
        return cls(x=x, y=y, z=1.0, length=length, angle=np.asarray(angle, np.float32))

    def at(self, places: NDArray[np.intp]) -> "Rays":
        """Return the rays at `places` of a row."""
        x, y, z = (each[places] for each in np.broadcast_arrays(self.x, self.y, self.z))
        return Rays(x=x, y=y, z=z, length=self.length[places], angle=self.angle[places])


@dataclass(frozen=True, kw_only=True, eq=False)
class Meeting:
    """The points where rays meet a planet, or come nearest to it; lengths in its mean radius, float32 (N,)."""

    covered: Float32
    """The share of the pixel that the planet fills."""
    normal: list[Float]
    """x, y, z in planet axes, outward, float64."""
    height: Float32
    """Above the surface."""
    toward: Float32
    """The cosine of the angle between the normal and the way back."""
    footprint: Float32
    """The length that the pixel spans on the surface."""
    inside: Float32
    """How many pixels it is from the limb, negative outside."""


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
        return length(self.centre)

    @cached_property
    def angular_radius_sine(self) -> float:
        """Sine of the angular radius within which it and its air lie."""
        planet = self.planet
        air = AIR_HEIGHTS * planet.atmosphere if any(planet.haze) else 0.0
        return min((max(planet.radii) + air) / self.distance, 1.0)

    @property
    def scale_height(self) -> float:
        """The air's scale height in mean radii of the planet; 0 without air."""
        return self.planet.atmosphere * 3 / sum(self.planet.radii)

    @cached_property
    def air(self) -> Air | None:
        """The planet's air, None where it has none."""
        if self.planet.atmosphere <= 0 or not any(self.planet.haze):
            return None
        return Air(scale_height=self.scale_height, depth=self.planet.haze)

    @cached_property
    def mapped(self) -> bool:
        """Whether the planet has images, between whose texels there is detail."""
        return any(isinstance(each, Image) for each in (self.planet.albedo, self.planet.clouds, self.planet.night))

    def meet(self, rays: Rays) -> Meeting:
        """Return the points where the rays meet the planet; nothing is covered behind the eye."""
        radii, turn = np.array(self.planet.radii), self.planet.T_cam_planet.rotation.T
        mean = (radii[0] + radii[1] + radii[2]) / 3
        o = rotated(turn / radii[:, None], list(-self.centre))  # the planet is the unit sphere
        d = rotated(turn / radii[:, None], [rays.x, rays.y, rays.z])
        dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        od = o[0] * d[0] + o[1] * d[1] + o[2] * d[2]
        inside = od * od / dd - (
            o[0] * o[0] + o[1] * o[1] + o[2] * o[2] - 1
        )  # 1 - (the ray's distance to the centre)^2
        way = (-od - np.sqrt(np.maximum(inside, 0) * dd)) / dd
        normal = _unit([(i + way * j) * (mean / r) for i, j, r in zip(o, d, radii, strict=True)])
        span = np.maximum(way.astype(np.float32) * rays.angle * rays.length / np.float32(mean), MIN_SPAN)
        gap = (inside / (1 + np.sqrt(np.maximum(1 - inside, 0)))).astype(np.float32)  # 1 - that distance
        pixels = np.where(od < 0, gap / span, np.float32(-BEHIND))
        back = [n * i * -r for n, i, r in zip(normal, d, radii, strict=True)]
        toward = np.maximum((back[0] + back[1] + back[2]).astype(np.float32) / rays.length, 0)
        tilt = np.sqrt(np.maximum(toward, MIN_TOWARD))
        return Meeting(
            covered=np.clip(pixels + np.float32(0.5), 0, 1),
            normal=normal,
            height=np.where(od < 0, np.maximum(-gap, 0), BEHIND),
            toward=toward,
            footprint=span / (tilt * np.sqrt(tilt)),
            inside=pixels,
        )


def _unit(v: list[Float]) -> list[Float]:
    scale = 1 / np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return [c * scale for c in v]

"""The light that reaches the target from all around: domes and sunlit planets, as one latitude-longitude image."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, digest
from spin_usd.renderers.background.dome import dome_radiance
from spin_usd.renderers.background.elementary import Float32, rotated
from spin_usd.renderers.background.globe import Globe, Rays
from spin_usd.renderers.background.planet_light import planet_light
from spin_usd.renderers.background.planet_points import Points
from spin_usd.renderers.background.planet_radiance import mean_radiance
from spin_usd.renderers.background.planet_sunlight import suns_of_planets
from spin_usd.scene.content import content
from spin_usd.scene.environment import Planet
from spin_usd.scene.light import DistantLight, DomeLight
from spin_usd.scene.scene import Scene
from spin_usd.scene.texture import Color

HEIGHT = 256  # texels of 0.7 degrees: only a mirror could show finer light of a planet
MAX_HEIGHT = 2048
SMALL_TEXELS = 6.0  # radius of a planet whose rays are spread over texels one by one
NEARBY = 1e-3  # of a planet's distance from its surface: so far the target may be from where it is seen from
DIGITS = 9  # of directions, and of places in planet radii, that count as the same


@dataclass(frozen=True, kw_only=True, eq=False)
class Surroundings:
    """Domes and planets around the target."""

    domes: tuple[DomeLight, ...]
    globes: tuple[Globe, ...]
    suns: tuple[DistantLight, ...]
    rotation: Float
    """(3, 3): from the image's axes to the camera's; in those axes the image lies as a DomeLight's."""

    @classmethod
    def of(cls, scene: Scene) -> "Surroundings | None":
        """Return the surroundings of `scene`, None where all is dark."""
        domes = tuple(light for light in scene.lights if isinstance(light, DomeLight) and any(light.radiance))
        suns = suns_of_planets(scene.lights)
        globes = tuple(_seen_from_target(scene)) if suns or domes else ()
        if not domes and not globes:
            return None
        axes = [dome.T_cam_dome for dome in domes if dome.image] + [globe.planet.T_cam_planet for globe in globes]
        return cls(domes=domes, globes=globes, suns=suns, rotation=axes[0].rotation if axes else np.eye(3))

    @property
    def uniform(self) -> Color | None:
        """The radiance that is the same from everywhere, None where it varies."""
        if self.globes or any(dome.image for dome in self.domes):
            return None
        r, g, b = (float(sum(dome.radiance[c] for dome in self.domes)) for c in range(3))
        return r, g, b

    @cached_property
    def key(self) -> str:
        """Digest of all that decides the image; the camera's attitude does not."""
        turn = self.rotation.T
        domes = [[content(d.image), d.radiance, _rounded(turn @ d.T_cam_dome.rotation)] for d in self.domes]
        suns = [[sun.irradiance, sun.angle, _rounded(turn @ sun.direction_cam)] for sun in self.suns]
        globes = []
        for planet, globe in ((globe.planet, globe) for globe in self.globes):
            place = _rounded(turn @ globe.centre / max(planet.radii))
            shape = [planet.radii, place, _rounded(turn @ planet.T_cam_planet.rotation)]
            globes.append([*shape, content(_look(planet))])
        return digest([domes, globes, suns if globes else []])

    @cached_property
    def pixels(self) -> Float32:
        """(H, W, 3) W/m2/sr, the top row first."""
        if not self.globes and len(self.domes) == 1 and self.domes[0].image:
            return self.domes[0].image.pixels[..., :3] * np.array(self.domes[0].radiance, np.float32)
        images = [dome.image.pixels.shape[0] for dome in self.domes if dome.image]
        grid = Grid(height=min(max([HEIGHT, *images]), MAX_HEIGHT), rotation=self.rotation)
        radiance = np.zeros((3, grid.height * grid.width), np.float32)
        for dome in self.domes:
            radiance += np.stack(dome_radiance(dome, grid.rays))
        for globe in sorted(self.globes, key=lambda globe: -globe.distance):
            _add_globe(radiance, grid, globe, self.suns)
        return np.ascontiguousarray(np.moveaxis(radiance.reshape(3, grid.height, grid.width), 0, -1))


@dataclass(frozen=True, kw_only=True, eq=False)
class Grid:
    """The texels of an image twice as wide as high."""

    height: int
    rotation: Float

    @property
    def width(self) -> int:
        """Return the texels in a row."""
        return 2 * self.height

    @cached_property
    def rays(self) -> Rays:
        """Return rays through the centres of the texels, in rows from the top."""
        longitude = ((np.arange(self.width) + 0.5) / self.width - 0.5) * 2 * np.pi
        latitude = (0.5 - (np.arange(self.height) + 0.5) / self.height)[:, None] * np.pi
        cosine, one = np.cos(latitude), np.ones(self.width)
        own = np.stack([cosine * np.sin(longitude), np.sin(latitude) * one, -cosine * np.cos(longitude)])
        x, y, z = rotated(self.rotation, list(own.reshape(3, -1)))
        ones = np.ones(len(x), np.float32)
        return Rays(x=x, y=y, z=z, length=ones, angle=ones * np.float32(np.pi / self.height))

    @cached_property
    def solid_angles(self) -> Float:
        """(height * width,) sr of each texel."""
        edges = np.sin((0.5 - np.arange(self.height + 1) / self.height) * np.pi)
        return np.repeat((edges[:-1] - edges[1:]) * (2 * np.pi / self.width), self.width)

    def seeing(self, globe: Globe) -> NDArray[np.intp]:
        """Return the texels, among all in rows from the top, that may see the planet or its air."""
        rays, axis = self.rays, globe.centre / globe.distance
        radius = np.arcsin(globe.angular_radius_sine) + 2 * np.pi / self.height
        return np.flatnonzero(rays.x * axis[0] + rays.y * axis[1] + rays.z * axis[2] > np.cos(radius))

    def spread(self, rays: Rays, light: Float) -> Float32:
        """Return the radiance (3, height * width) of `light` (N, 3), W/m2, along the rays, each over the four texels
        around it."""
        x, y, z = rotated(self.rotation.T, [rays.x, rays.y, rays.z])
        column = np.arctan2(x, -z) / (2 * np.pi) * self.width + self.width / 2 - 0.5
        row = np.clip(self.height / 2 - np.arctan2(y, np.hypot(x, z)) / np.pi * self.height - 0.5, 0, self.height - 1)
        left, top = np.floor(column), np.minimum(np.floor(row), self.height - 2)
        total = np.zeros((3, self.height * self.width))
        for dy in (0, 1):
            for dx in (0, 1):
                weight = np.abs(1 - dx - (column - left)) * np.abs(1 - dy - (row - top))
                at = ((top + dy) * self.width + (left + dx) % self.width).astype(int)
                for c in range(3):
                    total[c] += np.bincount(at, weight * light[:, c], minlength=total.shape[1])
        return np.asarray(total / self.solid_angles, np.float32)


def _add_globe(radiance: Float32, grid: Grid, globe: Globe, suns: tuple[DistantLight, ...]) -> None:
    """Add a planet to the image (3, N), with all of its light."""
    rays, light = planet_light(globe, suns)
    if globe.angular_radius_sine * grid.height / np.pi < SMALL_TEXELS:
        radiance += grid.spread(rays, light)
        return
    texels = grid.seeing(globe)
    points = Points.of(globe, suns, grid.rays.at(texels))
    own = np.stack(mean_radiance(points))
    scale = light.sum(0) / np.maximum(own @ grid.solid_angles[texels], np.finfo(float).tiny)
    behind = radiance[:, texels] * np.stack(points.transmittance)
    radiance[:, texels] = behind + own * scale.astype(np.float32)[:, None]


def _seen_from_target(scene: Scene) -> list[Globe]:
    """Return the planets that light the first target, as seen from it, or from the camera if equivalent, so that poses
    share them."""
    first = scene.bodies[0]
    target = first.T_cam_body.points(first.target.mesh.centre)
    globes = []
    for planet in scene.environment.illuminating:
        globe = Globe(planet=planet, eye=np.zeros(3))
        height = globe.distance - max(planet.radii)
        near = np.linalg.norm(target) <= NEARBY * height
        globes.append(globe if near else Globe(planet=planet, eye=target))
    return globes


def _look(planet: Planet) -> list[object]:
    """Return all of a planet that decides its light, but its shape and place."""
    maps = [planet.albedo, planet.clouds, planet.night, planet.night_radiance]
    return [*maps, planet.atmosphere, planet.haze, planet.appearance]


def _rounded(values: Float) -> list[float]:
    return [float(value) + 0.0 for value in np.round(values, DIGITS).ravel()]

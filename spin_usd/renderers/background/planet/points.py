"""Points of a planet as they are seen: where they lie, how they are lit, what weather they have."""

from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from spin_usd.arrays import Float
from spin_usd.renderers.background.planet.elementary import Float32
from spin_usd.renderers.background.planet.globe import Globe, Meeting, Rays
from spin_usd.renderers.background.planet.octaves import Face, faces_of, present
from spin_usd.renderers.background.planet.sunlight import SunAtPoints, sunlight, transmittances
from spin_usd.renderers.background.planet.weather import Weather
from spin_usd.scene.light import DistantLight

Record = TypeVar("Record", Meeting, SunAtPoints)
MOST_PIXELS = np.float32(1e6)


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """Points of any shape. through: the share of light, R, G, B, that the air in front lets pass · suns: each one's
    light. Of a grid, on a planet that has maps: weather · faces: where they lie on the noise, stirred · across, down:
    pixels in a radian toward each Sun, times the tangent of its zenith angle."""

    globe: Globe
    meeting: Meeting
    through: list[Float32]
    suns: tuple[SunAtPoints, ...]
    weather: Weather | None = None
    faces: tuple[Face, ...] = ()
    across: tuple[Float32, ...] = ()
    down: tuple[Float32, ...] = ()

    @classmethod
    def of(cls, globe: Globe, suns: tuple[DistantLight, ...], rays: Rays) -> "Points":
        """Return the points that the rays meet."""
        meeting = globe.meet(rays)
        through = transmittances(globe.air, meeting)
        return cls(
            globe=globe,
            meeting=meeting,
            through=through,
            suns=tuple(sunlight(globe, sun, rays, meeting, through) for sun in suns),
        )

    def on_grid(self, spacing: int, weather: Weather | None = None) -> "Points":
        """Return them with their weather and the ways to the Suns, of points (R, C) that lie `spacing` pixels from one
        another. `weather`: what it is known to be."""
        if not self.globe.mapped:
            return self
        faces = faces_of(self.meeting.normal)
        weather = weather or Weather.of(faces, self.meeting.footprint)
        ways = [_way(self.meeting.normal, sun, spacing) for sun in self.suns]
        across, down = tuple(way[0] for way in ways), tuple(way[1] for way in ways)
        return replace(self, weather=weather, faces=weather.stirred(faces), across=across, down=down)

    def part(self, slices: tuple[slice, ...]) -> "Points":
        """Return the points at `slices` alone."""
        return replace(
            self,
            meeting=_part(self.meeting, slices),
            through=[each[slices] for each in self.through],
            suns=tuple(_part(sun, slices) for sun in self.suns),
            weather=self.weather and self.weather.part(slices),
            faces=tuple(present(self.faces, slices)),
            across=tuple(each[slices] for each in self.across),
            down=tuple(each[slices] for each in self.down),
        )


def _part(record: Record, slices: tuple[slice, ...]) -> Record:
    def cut(value: Any) -> Any:
        if isinstance(value, list):
            return [each[slices] for each in value]
        return value[slices] if isinstance(value, np.ndarray) and value.ndim == len(slices) else value

    changes: dict[str, Any] = {field.name: cut(getattr(record, field.name)) for field in fields(record)}
    return replace(record, **changes)


def _way(normal: list[Float], sun: SunAtPoints, spacing: int) -> tuple[Float32, Float32]:
    """Return how many pixels right and down (R, C) a point moves along the ground toward `sun`, by a height of 1."""
    right, below = ([np.gradient(n, axis=axis) / spacing for n in normal] for axis in (1, 0))
    s = sun.direction
    rr, bb, rb = (_dot(p, q) for p, q in ((right, right), (below, below), (right, below)))
    rs, bs = (p[0] * s[0] + p[1] * s[1] + p[2] * s[2] for p in (right, below))
    size = np.maximum(rr * bb - rb * rb, 1e-9 * rr * bb + 1e-300) * np.maximum(sun.cosine, 0.06)
    ways = (rs * bb - bs * rb) / size, (bs * rr - rs * rb) / size
    found = [np.clip(way, -MOST_PIXELS, MOST_PIXELS).astype(np.float32) for way in ways]
    return found[0], found[1]


def _dot(p: list[Float], q: list[Float]) -> Float:
    return np.asarray(p[0] * q[0] + p[1] * q[1] + p[2] * q[2])

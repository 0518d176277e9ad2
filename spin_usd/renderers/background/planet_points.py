"""Visible points of a planet: their places, light and weather."""

from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.renderers.background.elementary import Float32
from spin_usd.renderers.background.globe import Globe, Meeting, Rays
from spin_usd.renderers.background.noise_octaves import Face, faces_of, present
from spin_usd.renderers.background.planet_sunlight import SunAtPoints, sunlight, transmittances
from spin_usd.renderers.background.weather import Weather
from spin_usd.scene.light import DistantLight

Record = TypeVar("Record", Meeting, SunAtPoints)


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """Points of any shape."""

    globe: Globe
    meeting: Meeting
    through: list[Float32]
    """The share of light, R, G, B, that the air in front lets pass."""
    suns: tuple[SunAtPoints, ...]
    """Each one's light."""
    weather: Weather | None = None
    """On a planet with maps, if detail is requested."""
    faces: tuple[Face, ...] = ()
    """Where the points lie on the noise, stirred, and the ways from there to the Suns; likewise."""

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

    @property
    def transmittance(self) -> list[Float32]:
        """The share of light, R, G, B, from behind that gets past the planet and its air."""
        return [(1 - self.meeting.covered) * through for through in self.through]

    def with_weather(self, weather: Weather | None = None) -> "Points":
        """Return the points with their weather, `weather` if known, and the ways to the Suns; as they are on a
        planet without maps."""
        if not self.globe.mapped:
            return self
        faces = faces_of(self.meeting.normal, [_way(self.meeting.normal, sun) for sun in self.suns])
        weather = weather or Weather.of(faces, self.meeting.footprint)
        return replace(self, weather=weather, faces=weather.stirred(faces))

    def part(self, slices: tuple[slice, ...]) -> "Points":
        """Return the points at `slices` alone."""
        return replace(
            self,
            meeting=_part(self.meeting, slices),
            through=[each[slices] for each in self.through],
            suns=tuple(_part(sun, slices) for sun in self.suns),
            weather=self.weather and self.weather.part(slices),
            faces=tuple(present(self.faces, slices)),
        )


def _part(record: Record, slices: tuple[slice, ...]) -> Record:
    def cut(value: Any) -> Any:
        if isinstance(value, list):
            return [each[slices] for each in value]
        return value[slices] if isinstance(value, np.ndarray) and value.ndim == len(slices) else value

    changes: dict[str, Any] = {field.name: cut(getattr(record, field.name)) for field in fields(record)}
    return replace(record, **changes)


def _way(normal: list[Float], sun: SunAtPoints) -> list[Float]:
    """Return the unit vectors along the ground toward `sun`."""
    along = [sun.direction[i] - n * sun.cosine for i, n in enumerate(normal)]
    size = np.sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2])
    return [each / np.maximum(size, 1e-6) for each in along]

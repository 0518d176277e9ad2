"""A planned picture of a run."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class PlannedPicture:
    """One picture to make: its place in the stage, its content keys, the pixels to render, about how many of them show
    the target, the number of light groups, its features that cost time (see work.features), its facts stated by the
    stage (FrameId.stated), and the keys of requested labels that more than the geometry decides."""

    variant: str
    index: int
    frame: str
    time_code: float
    geometry: str
    radiance: str
    exposure: str
    targets: str
    region: tuple[int, int, int, int]
    target_pixels: int
    light_groups: int
    features: tuple[str, ...]
    stated: Mapping[str, str | float] = field(default_factory=dict)
    label_keys: Mapping[str, str] = field(default_factory=dict)

    @property
    def region_pixels(self) -> int:
        x0, y0, x1, y1 = self.region
        return max(x1 - x0, 0) * max(y1 - y0, 0)

    @property
    def keys(self) -> dict[str, str]:
        return {
            "geometry": self.geometry,
            "radiance": self.radiance,
            "exposure": self.exposure,
            "targets": self.targets,
            **self.label_keys,
        }

    def label_key(self, name: str) -> str:
        """Return the key of the label of that name."""
        return self.label_keys.get(name, self.geometry)

    @property
    def name(self) -> str:
        return f"{self.variant}/{self.frame}"


def places_of(pictures: Iterable[PlannedPicture]) -> dict[str, list[int]]:
    """Return the places in the stage of the pictures of each variant."""
    places: dict[str, list[int]] = {}
    for picture in pictures:
        places.setdefault(picture.variant, []).append(picture.index)
    return places

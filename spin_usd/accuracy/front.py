"""The Pareto front: the measured settings that no other beats in both cost and error."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from spin_usd.accuracy.measurement import Configuration, Figures, Measurement


class Criterion(Enum):
    """The measure of an error: relative, in linear light; or after the detector, over the detector's own noise."""

    LIGHT = "light"
    IMAGE = "image"


class Error(NamedTuple):
    """An error as expected, and the most that it may be, as far as was measured."""

    expected: float
    at_most: float


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A setting on all pictures of a measurement, one or more."""

    setting: Configuration
    figures: tuple[Figures, ...]
    """Of each picture, in their order."""
    noise_dn: tuple[float, ...]
    """The detector's own noise in each, digital numbers."""

    @property
    def cpu_s(self) -> float:
        """Seconds of one core that a picture takes, their mean."""
        return sum(each.cpu_s for each in self.figures) / len(self.figures)

    def errors(self, criterion: Criterion) -> tuple[Error, ...]:
        """Return the error of each picture."""
        if criterion is Criterion.LIGHT:
            return tuple(Error(each.error, each.error_at_most) for each in self.figures)
        pairs = zip(self.figures, self.noise_dn, strict=True)
        return tuple(Error(_ratio(each.error_dn, noise), _ratio(each.error_dn_at_most, noise)) for each, noise in pairs)

    def worst(self, criterion: Criterion) -> int:
        """Return the place of the picture whose error may be the greatest."""
        most = [each.at_most for each in self.errors(criterion)]
        return most.index(max(most))

    def error(self, criterion: Criterion) -> Error:
        """Return the error of the worst picture."""
        return self.errors(criterion)[self.worst(criterion)]

    @property
    def in_image(self) -> tuple[float, float]:
        """The error after the detector and the detector's own noise in the worst picture, digital numbers."""
        place = self.worst(Criterion.IMAGE)
        return self.figures[place].error_dn, self.noise_dn[place]


def outcomes(measurement: Measurement) -> tuple[Outcome, ...]:
    """Return the outcomes of the settings that were measured on all pictures, in the order of the measurement."""
    measured: dict[Configuration, dict[str, Figures]] = {}
    for figures in measurement.figures:
        measured.setdefault(figures.setting, {})[figures.frame] = figures
    frames = measurement.frames
    noise_dn = tuple(frame.noise_dn for frame in frames)
    return tuple(
        Outcome(setting=setting, figures=tuple(by_frame[frame.name] for frame in frames), noise_dn=noise_dn)
        for setting, by_frame in measured.items()
        if frames and all(frame.name in by_frame for frame in frames)
    )


def front(outcomes: Iterable[Outcome], criterion: Criterion) -> tuple[Outcome, ...]:
    """Return the Pareto front of cost and upper bound of the error: the cheapest first, each next one more exact than
    all before."""
    order = {each: (each.cpu_s, each.error(criterion).at_most) for each in outcomes}
    found: list[Outcome] = []
    for outcome in sorted(order, key=lambda each: order[each]):
        if not found or order[outcome][1] < order[found[-1]][1]:
            found.append(outcome)
    return tuple(found)


def _ratio(error: float, noise: float) -> float:
    if noise:
        return error / noise
    return float("inf") if error else 0.0

"""Of the settings measured, those that no other beats: none is as cheap and as exact."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from operator import itemgetter

from spin_usd.measuring.measurement import Figures, Measurement, Setting


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A setting on all pictures of a measurement, one or more.

    figures: of each picture, in their order · noise_dn: the detector's own noise in each, digital numbers.
    """

    setting: Setting
    figures: tuple[Figures, ...]
    noise_dn: tuple[float, ...]

    @property
    def cpu_s(self) -> float:
        """Seconds of one core that a picture takes, their mean."""
        return sum(each.cpu_s for each in self.figures) / len(self.figures)

    @property
    def errors(self) -> tuple[float, ...]:
        """Relative, in linear light, of each picture."""
        return tuple(each.error for each in self.figures)

    @property
    def shares(self) -> tuple[float, ...]:
        """Error after the detector over the detector's own noise, of each picture."""
        pairs = zip(self.figures, self.noise_dn, strict=True)
        return tuple(_ratio(each.error_dn, noise) for each, noise in pairs)

    @property
    def error_at_most(self) -> float:
        """As `error`, where each picture's error is as great as its uncertainty allows."""
        return self.error_expected[1]

    @property
    def of_noise_at_most(self) -> float:
        """As `of_noise`, where each picture's error is as great as its uncertainty allows."""
        return self.of_noise_expected[1]

    @property
    def error_expected(self) -> tuple[float, float]:
        """Relative, and the most that it may be, in the picture where that is greatest."""
        return max(((each.error, each.error_at_most) for each in self.figures), key=itemgetter(1))

    @property
    def of_noise_expected(self) -> tuple[float, float]:
        """Of the detector's own noise, and the most that it may be, in the picture where that is greatest."""
        pairs = zip(self.figures, self.noise_dn, strict=True)
        both = ((_ratio(each.error_dn, noise), _ratio(each.error_dn_at_most, noise)) for each, noise in pairs)
        return max(both, key=itemgetter(1))

    @property
    def worst(self) -> Figures:
        """Of the picture with the greatest of `errors`."""
        return self.figures[self.errors.index(self.error)]

    @property
    def in_image(self) -> tuple[float, float]:
        """Error after the detector and the detector's own noise, digital numbers, in the picture with the greatest of
        `shares`."""
        place = self.shares.index(self.of_noise)
        return self.figures[place].error_dn, self.noise_dn[place]

    @property
    def error(self) -> float:
        """The worst of `errors`."""
        return max(self.errors)

    @property
    def of_noise(self) -> float:
        """The worst of `shares`."""
        return max(self.shares)


def outcomes(measurement: Measurement) -> tuple[Outcome, ...]:
    """Of the settings that were measured on all pictures, in the order in which they were."""
    measured: dict[Setting, dict[str, Figures]] = {}
    for figures in measurement.figures:
        measured.setdefault(figures.setting, {})[figures.frame] = figures
    frames = measurement.frames
    noise_dn = tuple(frame.noise_dn for frame in frames)
    return tuple(
        Outcome(setting=setting, figures=tuple(by_frame[frame.name] for frame in frames), noise_dn=noise_dn)
        for setting, by_frame in measured.items()
        if frames and all(frame.name in by_frame for frame in frames)
    )


def relative_error(outcome: Outcome) -> float:
    return outcome.error


def share_of_noise(outcome: Outcome) -> float:
    return outcome.of_noise


def error_at_most(outcome: Outcome) -> float:
    return outcome.error_at_most


def share_at_most(outcome: Outcome) -> float:
    return outcome.of_noise_at_most


def front(outcomes: Iterable[Outcome], error: Callable[[Outcome], float] = relative_error) -> tuple[Outcome, ...]:
    """The Pareto front of cost and `error`: the cheapest first, and each next one more exact than all before it."""
    found: list[Outcome] = []
    for outcome in sorted(outcomes, key=lambda each: (each.cpu_s, error(each))):
        if not found or error(outcome) < error(found[-1]):
            found.append(outcome)
    return tuple(found)


def _ratio(error: float, noise: float) -> float:
    if noise:
        return error / noise
    return float("inf") if error else 0.0

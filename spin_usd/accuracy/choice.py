"""The cheapest measured setting that is good enough, or the measurement of a setting chosen otherwise.

Both are described in words: the worst picture's error with its uncertainty, its light, its cost.
"""

from dataclasses import dataclass
from decimal import ROUND_CEILING, Context

from spin_usd.accuracy.front import Criterion, Outcome, front, outcomes
from spin_usd.accuracy.measurement import Configuration, Measurement
from spin_usd.accuracy.tables import number, percent
from spin_usd.errors import InputError

AUTO = 1.0
"""Of the detector's noise: the two are independent, so the image's total error is at most sqrt(2) times that noise."""

ROUNDING_DN = 0.3
"""A detector with no more noise than this has none of its own: rounding alone is 1 / sqrt(12) = 0.289."""
WORTH_SAYING = 0.01  # of the target's light


@dataclass(frozen=True, kw_only=True)
class SettingChoice:
    """A setting, and why it was chosen."""

    outcome: Outcome
    """Measured result of the setting."""
    bound: float
    """The most that its error by the criterion may be in each picture."""
    criterion: Criterion
    cheaper: Outcome | None
    """The next cheaper one on the front, not good enough; None if there is none."""

    @property
    def setting(self) -> Configuration:
        return self.outcome.setting

    @property
    def reason(self) -> str:
        """The reason of the choice, in a sentence."""
        count = len(self.outcome.figures)
        where = "the picture measured" if count == 1 else f"each of the {count} pictures measured"
        said = f"{self.setting.text} is the cheapest setting with {_bound_text(self.bound, self.criterion)} in {where}"
        error = f"{error_text(self.outcome, self.criterion)}{light_text(self.outcome)}"
        said += f": expected error {error}, for {cost_text(self.outcome)}"
        if self.cheaper is None:
            return f"{said}; none is cheaper"
        return f"{said}; the next cheaper, {self.cheaper.setting.text}, has {expected(self.cheaper, self.criterion)}"


def choose(
    measurement: Measurement, *, error: float | None = None, auto: bool = False, renderer: str = "blender"
) -> SettingChoice:
    """Return the cheapest setting of `renderer` within a bound in every picture measured, as far as was measured there:
    its relative error in linear light at most `error`; with `auto` instead, its error after the detector at most AUTO
    of the detector's own noise. Raises InputError where none is.
    """
    if auto == (error is not None):
        raise InputError("neither or both of error and auto are given", do="give one of them")
    bound = AUTO if error is None else error
    if not 0 < bound < float("inf"):
        raise InputError(
            f"an error of {bound:g} is not a bound", do="make it a number above 0, such as 0.05 for 5 %, or auto"
        )
    criterion = Criterion.IMAGE if auto else Criterion.LIGHT
    found = front(_measured(measurement, renderer), criterion)
    place = next((i for i, each in enumerate(found) if each.error(criterion).at_most <= bound), None)
    if place is None:
        raise _none_enough(found[-1], bound, criterion)
    return SettingChoice(
        outcome=found[place], bound=bound, criterion=criterion, cheaper=found[place - 1] if place else None
    )


def most_exact(measurement: Measurement) -> Outcome | None:
    """Return the outcome of Blender's setting whose error after the detector is the least beside the detector's noise;
    None where nothing was measured, or where the detector has no noise."""
    found = front((each for each in outcomes(measurement) if each.setting.renderer == "blender"), Criterion.IMAGE)
    return found[-1] if found and max(found[-1].noise_dn) > ROUNDING_DN else None


def _measured(measurement: Measurement, renderer: str) -> list[Outcome]:
    measured = [each for each in outcomes(measurement) if each.setting.renderer == renderer]
    if not measured:
        found = f"no setting of the renderer {renderer} was measured on all pictures"
        raise InputError(found, do="run spin-usd measure, which resumes")
    return measured


def _none_enough(best: Outcome, bound: float, criterion: Criterion) -> InputError:
    auto, noise = criterion is Criterion.IMAGE, max(best.noise_dn)
    if auto and noise <= ROUNDING_DN:
        found = f"the detector has no noise but its rounding ({number(noise)} DN)"
        return InputError(found, do="author read noise, or use --error X")
    least = f"the least is {error_text(best, criterion)}, of {best.setting.text} for {number(best.cpu_s)} CPU s"
    other = "--error X or --samples N" if auto else f"--error {_rounded_up(best.error(criterion).at_most)} or more"
    return InputError(
        f"no setting measured has {_bound_text(bound, criterion)} in every picture: {least}",
        do=f"give {other}, or measure settings that try harder",
    )


def _bound_text(bound: float, criterion: Criterion) -> str:
    if criterion is Criterion.IMAGE:
        return "an error after the detector of at most the detector's own noise"
    return f"an error of at most {percent(bound)}"


def _rounded_up(value: float) -> str:
    """Return three digits of the value, rounded up, and never as a power of ten."""
    return f"{Context(prec=3, rounding=ROUND_CEILING).create_decimal_from_float(value):f}"


def outcome_of(measurement: Measurement, setting: Configuration) -> Outcome | None:
    """Return the outcome of a setting; None where it was not measured on all pictures."""
    return next((each for each in outcomes(measurement) if each.setting == setting), None)


def expectation(measurement: Measurement, outcome: Outcome) -> str:
    """Return a sentence on the outcome's expected error, light and cost, and on the cheapest setting of its renderer
    that is cheaper and more exact."""
    error = f"{error_text(outcome, Criterion.LIGHT)}{light_text(outcome)}"
    said = f"expected error {error}, for {cost_text(outcome)}, as measured on this stage"
    better = [each for each in outcomes(measurement) if _beats(each, outcome)]
    if not better:
        return said
    best = min(better, key=lambda each: each.cpu_s)
    return f"{said}; {best.setting.text} is cheaper and more exact: {expected(best, Criterion.LIGHT)}"


def _beats(one: Outcome, other: Outcome) -> bool:
    alike = one.setting.renderer == other.setting.renderer
    errors = [each.error(Criterion.LIGHT).at_most for each in (one, other)]
    return alike and one.cpu_s < other.cpu_s and errors[0] < errors[1]


def expected(outcome: Outcome, criterion: Criterion) -> str:
    """Return the error and the cost of an outcome."""
    return f"{error_text(outcome, criterion)} for {cost_text(outcome)}"


def error_text(outcome: Outcome, criterion: Criterion) -> str:
    """Return the error in the worst picture, with its uncertainty."""
    error, most = outcome.error(criterion)
    value, unit = (percent, "") if criterion is Criterion.LIGHT else (number, " times the noise")
    return f"{value(error)}{f' ± {value(most - error)}' if most > error else ''}{unit}"


def light_text(outcome: Outcome) -> str:
    """Return a phrase such as ", the target 3 % darker" for the worst picture; "" where the difference is hardly
    visible."""
    brightness = max((each.brightness for each in outcome.figures), key=abs)
    if abs(brightness) <= WORTH_SAYING:
        return ""
    return f", the target {percent(abs(brightness))} {'brighter' if brightness > 0 else 'darker'}"


def cost_text(outcome: Outcome) -> str:
    return f"{number(outcome.cpu_s)} CPU s a picture"

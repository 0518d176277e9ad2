"""The cheapest setting measured that is good enough."""

from collections.abc import Callable
from dataclasses import dataclass
from decimal import ROUND_CEILING, Context

from spin_usd.errors import InputError
from spin_usd.measuring.front import Outcome, error_at_most, front, outcomes, share_at_most
from spin_usd.measuring.measurement import Measurement, Setting
from spin_usd.measuring.tables import number, percent
from spin_usd.measuring.wording import cost_text, error_text, expected, light_text

AUTO = 1.0
"""Of the detector's noise: the two are independent, so the image's total error is at most sqrt(2) times that noise."""

ROUNDING_DN = 0.3
"""A detector with no more noise than this has none of its own: rounding alone is 1 / sqrt(12) = 0.289."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A setting, and why it was chosen.

    outcome: what was measured of it · bound: the most that its error may be in each picture, relative or, with `auto`,
    of the detector's noise · cheaper: the next cheaper on the front, not good enough; None where there is none.
    """

    outcome: Outcome
    bound: float
    auto: bool
    cheaper: Outcome | None

    @property
    def setting(self) -> Setting:
        return self.outcome.setting

    @property
    def cpu_s(self) -> float:
        """Expected seconds of one core a picture."""
        return self.outcome.cpu_s

    @property
    def error(self) -> float:
        """Expected, of the same kind as the bound, in the picture where it may be the greatest."""
        return self._expected[0]

    @property
    def error_at_most(self) -> float:
        """With its uncertainty: what is within the bound."""
        return self._expected[1]

    @property
    def reason(self) -> str:
        """Why, in a sentence."""
        count = len(self.outcome.figures)
        where = "the picture measured" if count == 1 else f"each of the {count} pictures measured"
        said = f"{self.setting.text} is the cheapest setting with {_bound_text(self.bound, self.auto)} in {where}"
        error = f"{error_text(self.outcome, self.auto)}{light_text(self.outcome)}"
        said += f": expected error {error}, for {cost_text(self.outcome)}"
        if self.cheaper is None:
            return f"{said}; none is cheaper"
        return f"{said}; the next cheaper, {self.cheaper.setting.text}, has {expected(self.cheaper, self.auto)}"

    @property
    def _expected(self) -> tuple[float, float]:
        return self.outcome.of_noise_expected if self.auto else self.outcome.error_expected


def choose(
    measurement: Measurement, *, error: float | None = None, auto: bool = False, renderer: str = "blender"
) -> Choice:
    """The cheapest setting of `renderer` within a bound in every picture measured, as far as was measured there: its
    relative error in linear light at most `error`; with `auto` instead, its error after the detector at most AUTO of
    the detector's own noise. Raises InputError where none is.
    """
    if auto == (error is not None):
        raise InputError("neither or both of error and auto are asked for", do="ask for one of them")
    bound = AUTO if error is None else error
    if not 0 < bound < float("inf"):
        raise InputError(
            f"an error of {bound:g} is no bound", do="make it a number above 0, such as 0.05 for 5 %, or auto"
        )
    criterion = _criterion(auto)
    found = front(_measured(measurement, renderer), criterion)
    enough = [place for place, outcome in enumerate(found) if criterion(outcome) <= bound]
    if not enough:
        raise _none_enough(found[-1], bound, auto)
    place = enough[0]
    return Choice(outcome=found[place], bound=bound, auto=auto, cheaper=found[place - 1] if place else None)


def _measured(measurement: Measurement, renderer: str) -> list[Outcome]:
    measured = [each for each in outcomes(measurement) if each.setting.renderer == renderer]
    if not measured:
        found = f"no setting of the renderer {renderer} was measured on all pictures"
        raise InputError(found, do="run spin-usd measure, which resumes")
    return measured


def _none_enough(best: Outcome, bound: float, auto: bool) -> InputError:
    noise = max(best.noise_dn)
    if auto and noise <= ROUNDING_DN:
        found = f"the detector has no noise but its rounding ({number(noise)} DN)"
        return InputError(found, do="author read noise, or use --error X")
    least = f"the least is {error_text(best, auto)}, of {best.setting.text} for {number(best.cpu_s)} CPU s"
    do = "measure settings that try harder"
    also = "give --error X or --samples N" if auto else f"give --error {_rounded_up(best.error_at_most)} or more"
    return InputError(
        f"no setting measured has {_bound_text(bound, auto)} in every picture: {least}", do=f"{also}, or {do}"
    )


def _criterion(auto: bool) -> Callable[[Outcome], float]:
    return share_at_most if auto else error_at_most


def _bound_text(bound: float, auto: bool) -> str:
    if auto:
        return "an error after the detector of at most the detector's own noise"
    return f"an error of at most {percent(bound)}"


def _rounded_up(value: float) -> str:
    """Three digits of it, never less than it, and never as a power of ten."""
    return f"{Context(prec=3, rounding=ROUND_CEILING).create_decimal_from_float(value):f}"

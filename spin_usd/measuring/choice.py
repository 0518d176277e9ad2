"""The cheapest setting measured that is good enough."""

from collections.abc import Callable
from dataclasses import dataclass
from decimal import ROUND_CEILING, Context

from spin_usd.errors import InputError
from spin_usd.measuring.front import Outcome, front, outcomes, relative_error, share_of_noise
from spin_usd.measuring.measurement import Measurement, Setting
from spin_usd.measuring.tables import number, percent

AUTO = 1 / 3
"""Of the detector's noise: an error that adds no more raises the image's total error by at most 5.4 %, for the two are
independent: sqrt(1 + 1/9)."""


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
        """Expected, of the same kind as the bound."""
        return _criterion(self.auto)(self.outcome)

    @property
    def reason(self) -> str:
        """Why, in a sentence."""
        count = len(self.outcome.figures)
        where = "the picture measured" if count == 1 else f"each of the {count} pictures measured"
        chosen = f"the cheapest setting with {_bound_text(self.bound, self.auto)} in {where}"
        said = f"{self.setting.text} is {chosen}: {self._had(self.outcome)}"
        if self.cheaper is None:
            return f"{said}; none is cheaper"
        return f"{said}; the next cheaper, {self.cheaper.setting.text}, has {self._had(self.cheaper)}"

    def _had(self, outcome: Outcome) -> str:
        return f"{_text(_criterion(self.auto)(outcome), self.auto)} for {number(outcome.cpu_s)} CPU s a picture"


def choose(
    measurement: Measurement, *, error: float | None = None, auto: bool = False, renderer: str | None = None
) -> Choice:
    """The cheapest setting, of `renderer` alone where it is given, within a bound in every picture measured: its
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


def _measured(measurement: Measurement, renderer: str | None) -> list[Outcome]:
    found = [each for each in outcomes(measurement) if renderer in (None, each.setting.renderer)]
    if not found:
        of = f" of the renderer {renderer}" if renderer else ""
        raise InputError(f"no setting{of} was measured on all pictures", do="run spin-usd measure, which resumes")
    return found


def _none_enough(best: Outcome, bound: float, auto: bool) -> InputError:
    asked = _bound_text(bound, auto)
    least = f"the least is {_text(_criterion(auto)(best), auto)}, of {best.setting.text} for {number(best.cpu_s)} CPU s"
    do = "measure settings that try harder"
    also = "give --error X or --samples N" if auto else f"give --error {_rounded_up(best.error)} or more"
    return InputError(f"no setting measured has {asked} in every picture: {least}", do=f"{also}, or {do}")


def _criterion(auto: bool) -> Callable[[Outcome], float]:
    return share_of_noise if auto else relative_error


def _bound_text(bound: float, auto: bool) -> str:
    if auto:
        return "an error after the detector of at most a third of the detector's own noise"
    return f"an error of at most {_text(bound, auto)}"


def _text(value: float, auto: bool) -> str:
    return f"{number(value)} of it" if auto else percent(value)


def _rounded_up(value: float) -> str:
    """Three digits of it, never less than it, and never as a power of ten."""
    return f"{Context(prec=3, rounding=ROUND_CEILING).create_decimal_from_float(value):f}"

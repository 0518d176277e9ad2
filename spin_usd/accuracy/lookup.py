"""Look-up of a setting in a measurement from which it was not chosen."""

from spin_usd.accuracy.front import Criterion, Outcome, outcomes
from spin_usd.accuracy.measurement import Configuration, Measurement
from spin_usd.accuracy.text import cost_text, error_text, expected, light_text


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

"""Phrases on a setting's expected results: its worst picture's error with its uncertainty, its light, its cost."""

from spin_usd.accuracy.front import Criterion, Outcome
from spin_usd.accuracy.tables import number, percent

WORTH_SAYING = 0.01  # of the target's light


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

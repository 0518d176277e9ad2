"""What a setting is expected to do, in words: its worst picture's error with its uncertainty, its light, its cost."""

from spin_usd.measuring.front import Outcome
from spin_usd.measuring.tables import number, percent

WORTH_SAYING = 0.01  # of the target's light


def expected(outcome: Outcome, auto: bool) -> str:
    """Its error, of the detector's noise with `auto`, and its cost."""
    return f"{error_text(outcome, auto)} for {cost_text(outcome)}"


def error_text(outcome: Outcome, auto: bool) -> str:
    """In the picture where it may be the greatest, with what it may be more."""
    error, most = outcome.of_noise_expected if auto else outcome.error_expected
    more = f" ± {_value(most - error, auto)}" if most > error else ""
    return f"{_value(error, auto)}{more}{' times the noise' if auto else ''}"


def light_text(outcome: Outcome) -> str:
    """Such as ", the target 3 % darker" in the worst picture; nothing where it is hardly so."""
    brightness = max((each.brightness for each in outcome.figures), key=abs)
    if abs(brightness) <= WORTH_SAYING:
        return ""
    return f", the target {percent(abs(brightness))} {'brighter' if brightness > 0 else 'darker'}"


def cost_text(outcome: Outcome) -> str:
    return f"{number(outcome.cpu_s)} CPU s a picture"


def _value(value: float, auto: bool) -> str:
    return number(value) if auto else percent(value)

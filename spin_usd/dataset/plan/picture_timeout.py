"""The time limit of pictures that a user gives, in seconds of processor time."""

from spin_usd.errors import InputError

MIN_S, MAX_S = 1.0, 604800.0  # workers are looked at twice a second


def parse_time_limit(text: str) -> float:
    """Return the seconds that a user wrote. Raises InputError where the text is not a number."""
    try:
        return float(text)
    except ValueError:
        raise _refusal(repr(text)) from None


def refuse_time_limit(seconds: float | None) -> None:
    """Raise InputError for a limit that is finer than workers are looked at, longer than a week, or not a number."""
    if seconds is not None and not MIN_S <= seconds <= MAX_S:
        raise _refusal(f"{seconds:g}")


def _refusal(given: str) -> InputError:
    do = f"make it seconds from {MIN_S:g} to {MAX_S:.0f}, which is a week"
    return InputError(f"--picture-timeout (picture_timeout in Python) is {given}", do=do)

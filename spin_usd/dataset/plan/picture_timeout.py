"""The time limit of pictures that a user gives, in seconds."""

from spin_usd.errors import InputError

LEAST_S, MOST_S = 1.0, 604800.0  # workers are looked at twice a second


def parse_time_limit(text: str) -> float:
    """Return the number that the text is. Raises InputError where it is none."""
    try:
        return float(text)
    except ValueError:
        raise _refusal(repr(text)) from None


def refuse_time_limit(seconds: float | None) -> None:
    """Raise InputError for a user's limit that is finer than workers are looked at, or is none."""
    if seconds is not None and not LEAST_S <= seconds <= MOST_S:
        raise _refusal(f"{seconds:g}")


def _refusal(given: str) -> InputError:
    do = f"make it seconds from {LEAST_S:g} to {MOST_S:.0f}, which is a week"
    return InputError(f"--picture-timeout (picture_timeout in Python) is {given}", do=do)

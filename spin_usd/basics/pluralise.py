"""Numbers of things, for people."""


def pluralise(number: int, one: str, many: str = "") -> str:
    """Return the number with its noun, such as "1 picture" and "2 pictures"; `many` for irregular plurals."""
    return f"{number} {one}" if number == 1 else f"{number} {many or one + 's'}"


def duration(seconds: float) -> str:
    """Return the seconds in the unit that suits them: "48 s", "5 min", "2.5 h"."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"

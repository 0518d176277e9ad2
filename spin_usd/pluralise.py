"""Numbers of things, for people."""


def pluralise(number: int, one: str, many: str = "") -> str:
    """Return the number with its noun, such as "1 picture" and "2 pictures"; `many` where that takes no s."""
    return f"{number} {one}" if number == 1 else f"{number} {many or one + 's'}"

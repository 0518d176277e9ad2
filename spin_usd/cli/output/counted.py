"""Numbers of things, for people."""


def counted(number: int, one: str) -> str:
    """Return the number with its noun, such as "1 picture" and "2 pictures"."""
    return f"{number} {one}" if number == 1 else f"{number} {one}s"

"""Lines for people and programs. What is in them may come from anywhere; each stays one, and steers no terminal."""

import sys

from spin_usd.errors import printable


def show(*lines: str) -> None:
    """Print the lines on standard output."""
    for line in lines:
        sys.stdout.write(f"{printable(line)}\n")
    sys.stdout.flush()


def tell(*lines: str) -> None:
    """Print the lines on standard error."""
    for line in lines:
        sys.stderr.write(f"{printable(line)}\n")
    sys.stderr.flush()

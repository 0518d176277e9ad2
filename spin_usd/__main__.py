"""The console script, and `python -m spin_usd`: the command line, or one sentence that says what it lacks."""

import sys
from typing import NoReturn

from spin_usd.basics.faults import expected


def run() -> NoReturn:
    """Run the command line, whose packages come with the extra [render]."""
    try:
        from spin_usd.command_line import run as run_command_line
    except ModuleNotFoundError as fault:
        if (error := expected(fault)) is None:
            raise
        print(f"spin-usd: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    run_command_line()


if __name__ == "__main__":
    run()

"""--help answers at once: it loads the command line and what parses it, and nothing else."""

import subprocess
import sys

import pytest

from spin_usd.command_line import COMMANDS

LIGHT = {"annotated_doc", "click", "msgspec", "shellingham", "spin_usd", "typer", "typing_extensions"}
ALL_HELP = """
import contextlib, io, sys
from spin_usd.command_line import COMMANDS, app
for command in ["", *(command.__name__ for command in COMMANDS)]:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        app([*command.split(), "--help"])
print(*{name.partition(".")[0] for name in sys.modules})
"""


def test_no_help_loads_anything_heavy() -> None:
    loaded = subprocess.run([sys.executable, "-I", "-c", ALL_HELP], capture_output=True, text=True, check=True).stdout
    assert {name for name in loaded.split() if not name.startswith("_")} - sys.stdlib_module_names <= LIGHT


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.__name__)
def test_in_a_pipe_help_is_plain_and_says_all_that_a_command_does(command, spin_usd) -> None:
    text = spin_usd("--help").stdout
    assert not {"\x1b", "│"} & set(text)
    assert "".join(command.__doc__.splitlines()[0].split()) in "".join(text.split())

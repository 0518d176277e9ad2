"""The reference of the commands: each with its arguments and options, as its own help has them."""

from collections.abc import Iterator
from typing import Any

import typer
from pages.markdown import cell, table

from spin_usd.command_line import app
from spin_usd.terminal.help_text import EXAMPLES

INTRODUCTION = """# Commands

`spin-usd COMMAND --help` says the same. `--debug` (show tracebacks) and `--quiet` (show no progress) may stand
anywhere.
"""


def page() -> str:
    """Return the page, in Markdown."""
    group: Any = typer.main.get_command(app)
    end = f"{cell(app.info.epilog or '')}\n"
    return "\n".join((INTRODUCTION, end, *(line for command in group.commands.values() for line in _section(command))))


def _section(command: Any) -> Iterator[str]:
    context = command.make_context(command.name, [], resilient_parsing=True)
    usage = " ".join(command.collect_usage_pieces(context))
    yield f"## {command.name}\n\n{cell(command.help)}\n\n```text\nspin-usd {command.name} {usage}\n```\n"
    records = filter(None, (parameter.get_help_record(context) for parameter in command.get_params(context)))
    yield table(("argument or option", "what it is"), ((f"`{name.strip()}`", cell(text)) for name, text in records))
    if command.name in EXAMPLES:
        yield "\nFor example:\n\n```text\n" + "\n".join(EXAMPLES[command.name]) + "\n```"
    yield ""

"""Reports for programs: one JSON object on standard output, whose schema travels with spin_usd."""

import json
from typing import TYPE_CHECKING

from spin_usd.terminal.lines import print_out

if TYPE_CHECKING:
    from msgspec import Struct


def show_report(report: "Struct") -> None:
    """Print the `report` of a command in one line, by schemas/COMMAND-report-1.schema.json."""
    from msgspec import to_builtins  # not above: most commands print no report

    print_out(json.dumps(to_builtins(report)))

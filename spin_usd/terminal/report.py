"""Reports for programs: one JSON object on standard output, whose schema travels with spin_usd."""

import json
from collections.abc import Mapping
from typing import Any

from spin_usd.terminal.lines import print_out


def show_report(command: str, report: Mapping[str, Any]) -> None:
    """Print the `report` of a command in one line, by schemas/COMMAND-report-1.schema.json."""
    print_out(json.dumps({"schema": f"{command}-report-1", **report}))

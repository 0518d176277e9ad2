"""`spin-usd doctor`: prints what this machine has, and what it lacks."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from spin_usd.cli.arguments.options import Json
from spin_usd.cli.output.lines import BAD, DOUBTFUL, GOOD, Painted, show
from spin_usd.cli.output.report import show_report
from spin_usd.errors import FINDINGS

OK, MISSING = Painted("ok ", GOOD), Painted("NO ", BAD, bold=True)


def doctor(
    folder: Annotated[Path, typer.Option(help="Where datasets would go.")] = Path(),
    as_json: Json = False,
) -> None:
    """Say what this machine has and lacks, each line with its remedy."""
    from spin_usd.dataset.doctor import examine

    lines = []
    for line in examine(folder):
        lines.append(line)
        if not as_json:
            show((OK if line.well else MISSING, f" {line.subject:26} {line.found}"))
            if line.remedy:
                show(("    ", " " * 26, Painted(f" -> {line.remedy}", DOUBTFUL)))
    well = all(line.well for line in lines)
    if as_json:
        show_report("doctor", {"well": well, "lines": [asdict(line) for line in lines]})
    if not well:
        raise typer.Exit(FINDINGS)

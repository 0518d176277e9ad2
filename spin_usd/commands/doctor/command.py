"""`spin-usd doctor`: prints which requirements this machine meets, and which it lacks."""

from pathlib import Path
from typing import Annotated

import typer

from spin_usd.errors import FINDINGS
from spin_usd.terminal.lines import BAD, DOUBTFUL, GOOD, Painted, print_out, show_report
from spin_usd.terminal.parameters import Json

OK, MISSING = Painted("ok ", GOOD), Painted("NO ", BAD, bold=True)


def doctor(
    folder: Annotated[Path, typer.Option(help="Folder for datasets.")] = Path(),
    as_json: Json = False,
) -> None:
    """Report what this machine has and lacks, with a remedy for each line."""
    from spin_usd.commands.doctor.run import DoctorReport, examine

    lines = []
    for line in examine(folder):
        lines.append(line)
        if not as_json:
            print_out((OK if line.well else MISSING, f" {line.subject:26} {line.found}"))
            if line.remedy:
                print_out(("    ", " " * 26, Painted(f" -> {line.remedy}", DOUBTFUL)))
    well = all(line.well for line in lines)
    if as_json:
        show_report(DoctorReport(well=well, lines=lines))
    if not well:
        raise typer.Exit(FINDINGS)

"""`spin-usd export`: writes a dataset in another format, or lists the formats."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.export.options import ExportOptions
from spin_usd.errors import InputError
from spin_usd.options import run_with
from spin_usd.terminal.lines import NAME, Line, Painted, print_out, show_notes
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown

if TYPE_CHECKING:
    from spin_usd.commands.export.report import ExportReport


def export(
    context: typer.Context,
    options: ExportOptions | None,
    *,
    list_formats: Annotated[bool, typer.Option("--list", help="List the formats and their options, and exit.")] = False,
    as_json: Json = False,
) -> None:
    """Write a dataset in another format: SPEED+, SPARK, BOP, COCO and more."""
    if list_formats:
        print_out(*_formats())
        return
    if options is None:
        raise InputError("export needs a dataset, --to and --out", do="give all three, or --list for the formats")
    from spin_usd.commands.export.report import EXPORT
    from spin_usd.processes.child_ahead import child_ahead

    with child_ahead(EXPORT, writes=options.written), shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.export, options.telling(progress))
    show_notes(report.notes)
    print_out(json.dumps(asdict(report)) if as_json else _sentence(report, copied=options.copy))


def _sentence(report: "ExportReport", *, copied: bool) -> str:
    """Return one line on what was written; `copied`: whether no file is a link."""
    splits = ", ".join(f"{number} {split}" for split, number in report.splits.items())
    left_out = f"; {report.left_out} left out, as they do not show the target" if report.left_out else ""
    endings = sorted(report.made_endings.items(), key=lambda each: -each[1])
    made = f" ({', '.join(f'{number} {ending}' for ending, number in endings)})" if endings else ""
    as_they_are = "copied from the dataset" if copied else "linked to the dataset's"
    linked = f"{pluralise(report.linked, 'file')} {as_they_are}"
    files = f"{linked}, {report.made} made{made}, {report.kept} already there"
    return (
        f"{report.out}   ({pluralise(report.pictures, 'picture')} as {report.format}: {splits}{left_out}; {files}; "
        f"in {report.seconds:.1f} s)"
    )


def _formats() -> Iterator[Line]:
    """Yield a few lines for each format: its name, description and options."""
    from spin_usd.commands.export.run import export_formats

    for each in export_formats():
        yield Painted(each.name, NAME), f": {each.holds}"
        for choice in each.options:
            values = f" ({', '.join(choice.choices)})" if choice.choices else ""
            yield f"    --option {choice.name}={choice.default}: {choice.meaning}{values}"

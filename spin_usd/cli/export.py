"""`spin-usd export`: writes a dataset in a format of others, or lists the formats."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import spin_usd
from spin_usd.cli.arguments import options
from spin_usd.cli.arguments.completions import listed_in
from spin_usd.cli.output.lines import NAME, Line, Painted, show
from spin_usd.cli.output.progress import shown
from spin_usd.counted import counted
from spin_usd.dataset.process.processors import MAX_WORKERS
from spin_usd.errors import InputError

if TYPE_CHECKING:
    from spin_usd.dataset.export.report import ExportReport


def export(
    context: typer.Context,
    dataset: Annotated[Path | None, typer.Argument(help="A dataset's folder.")] = None,
    to: Annotated[
        str | None,
        typer.Option(
            autocompletion=listed_in("spin_usd.dataset.export.formats.table", "EXPORT_FORMATS"),
            metavar="NAME",
            help="The format; --list names all.",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The export's folder. Run again, it makes what is missing.")] = None,
    split: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=SHARE,...", help="Shares, such as train=0.8,validation=0.2; all is train if not given."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Decides which poses go into which split.")] = 0,
    frames: options.Frames = None,
    variants: options.Variants = "",
    target: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Which target, for formats that hold one; the first if not given."),
    ] = None,
    option: Annotated[
        list[str], typer.Option(metavar="NAME=VALUE", help="An option of the format; may be given several times.")
    ] = [],  # noqa: B006 - typer's way to say a list
    copy: Annotated[
        bool, typer.Option("--copy", help="Copy files that need no change; they are linked (hard links) if not given.")
    ] = False,
    workers: Annotated[
        int, typer.Option(metavar="N", min=1, max=MAX_WORKERS, help="Worker processes; their number changes no byte.")
    ] = 1,
    list_formats: Annotated[bool, typer.Option("--list", help="List the formats with their options, and end.")] = False,
    as_json: options.Json = False,
) -> None:
    """Write a dataset in a format of others: SPEED+, SPARK, BOP, COCO and more."""
    if list_formats:
        show(*_formats())
        return
    if dataset is None or to is None or out is None:
        raise InputError("export needs a dataset, --to and --out", do="give all three, or --list for the formats")
    with shown(context.obj["quiet"]) as progress:
        report = spin_usd.export(
            dataset,
            to=to,
            out=out,
            split=split,
            seed=seed,
            frames=frames,
            variants=variants,
            target=target,
            option=option,
            copy=copy,
            workers=workers,
            on_progress=progress,
        )
    show(json.dumps(asdict(report)) if as_json else _sentence(report))


def _sentence(report: "ExportReport") -> str:
    """Say in one line what was written."""
    splits = ", ".join(f"{number} {split}" for split, number in report.splits.items())
    left_out = f"; {report.left_out} left out, as they show no target" if report.left_out else ""
    files = f"{counted(report.linked, 'file')} linked, {report.made} made, {report.kept} already there"
    return (
        f"{report.out}   ({counted(report.pictures, 'picture')} as {report.format}: {splits}{left_out}; {files}; "
        f"in {report.seconds:.1f} s)"
    )


def _formats() -> Iterator[Line]:
    """Yield a few lines for each format: its name, what it is, its options."""
    from spin_usd.api.export import export_formats

    for each in export_formats():
        yield Painted(each.name, NAME), f": {each.holds}"
        for choice in each.options:
            values = f" ({', '.join(choice.choices)})" if choice.choices else ""
            yield f"    --option {choice.name}={choice.default}: {choice.meaning}{values}"

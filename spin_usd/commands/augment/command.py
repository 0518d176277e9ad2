"""`spin-usd augment`: adds the augmentations of a specification to a stage, or lists the parameters."""

import json
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import to_builtins

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.augment.options import AugmentOptions
from spin_usd.errors import InputError
from spin_usd.options import run_with
from spin_usd.terminal.lines import NAME, Line, Painted, print_out
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown

if TYPE_CHECKING:
    from spin_usd.commands.author.reports import ParameterRow  # which loads numpy

MAX_LISTED = 10


def augment(
    context: typer.Context,
    options: AugmentOptions | None,
    *,
    list_parameters: Annotated[
        bool, typer.Option("--list", help="List the parameters of specifications, with units and ranges, and exit.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Add the augmentations of a specification to a stage, one variant each. Another run replaces them."""
    if list_parameters:
        from spin_usd.commands.augment.run import parameters

        rows = parameters()
        print_out(*([json.dumps(to_builtins(rows))] if as_json else _in_lines(rows)))
        return
    if options is None:
        raise InputError(
            "augment needs a stage and --spec", do="give both, or --list for the parameters of a specification"
        )
    with shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.augment, options.telling(progress))
    if as_json:
        print_out(json.dumps(to_builtins(report)))
        return
    names = report.augmentations
    listed = ", ".join(names if len(names) <= MAX_LISTED else [*names[: MAX_LISTED - 1], "...", names[-1]])
    print_out(f"{report.root}   ({pluralise(len(names), 'augmentation')} of {report.spec}: {listed})")


def _in_lines(rows: "Sequence[ParameterRow]") -> Iterator[Line]:
    """Yield two lines for each parameter: its name, values and units; then its description."""
    for row in rows:
        unit, *others = row.units or ("",)
        also = f" (or in {', '.join(others)})" if others else ""
        takes = f"{row.takes} {unit}{also}".rstrip()
        once = "" if row.per_frame else ", one value for all pictures"
        yield Painted(row.name, NAME), f": {takes}{once}"
        yield f"    {row.description}"

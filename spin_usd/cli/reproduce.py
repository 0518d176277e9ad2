"""`spin-usd reproduce`: makes a picture again from its provenance, and compares the files."""

import json
from pathlib import Path
from typing import Annotated

import typer

import spin_usd
from spin_usd.cli.options import Json
from spin_usd.cli.output.lines import show
from spin_usd.cli.output.notes import show_notes
from spin_usd.errors import FINDINGS


def reproduce(
    dataset: Annotated[Path, typer.Argument(help="A dataset's folder.")],
    frame: Annotated[str, typer.Argument(help="A frame's name, such as img000001.")],
    variant: Annotated[str, typer.Option(metavar="NAME", help="The variant of the frame.")] = "nominal",
    as_json: Json = False,
) -> None:
    """Make one picture again from its provenance and compare it with the one there."""
    made = spin_usd.reproduce(dataset, frame, variant=variant)
    if as_json:
        show(json.dumps(made.as_json()))
    else:
        for file in made.files:
            word = "same" if file.same else "MISSING" if file.found is None else "DIFFERENT"
            show(f"{word:9}  {file.path}")
        changed = made.versions.items()
        show_notes(f"{name} was {recorded or 'absent'}, is {now or 'absent'}" for name, (recorded, now) in changed)
    if not made.same:
        raise typer.Exit(FINDINGS)

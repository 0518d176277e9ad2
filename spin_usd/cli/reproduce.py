"""`spin-usd reproduce`: makes a picture again from its provenance, and compares the files."""

import json
from pathlib import Path
from typing import Annotated

import typer

import spin_usd
from spin_usd.cli.arguments.completions import frames_of_dataset, listed_in, variants_of_dataset
from spin_usd.cli.arguments.options import Json
from spin_usd.cli.output.lines import BAD, GOOD, Painted, show
from spin_usd.cli.output.notes import show_note, show_notes
from spin_usd.errors import FINDINGS

OTHER_DEVICE = (
    "made on {}, and made again on {}: the image's bytes may differ, for each device rounds in its own way; labels are "
    "always the CPU's"
)


def reproduce(
    dataset: Annotated[Path, typer.Argument(help="A dataset's folder.")],
    frame: Annotated[str, typer.Argument(autocompletion=frames_of_dataset, help="A frame's name, such as img000001.")],
    variant: Annotated[
        str, typer.Option(autocompletion=variants_of_dataset, metavar="NAME", help="The variant of the frame.")
    ] = "nominal",
    device: Annotated[
        str | None,
        typer.Option(
            autocompletion=listed_in("spin_usd.dataset.process.devices", "DEVICES"),
            metavar="NAME",
            help="What renders the light: cpu, optix, cuda ...; the recorded one if not given.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Make one picture again from its provenance and compare it with the one there."""
    made = spin_usd.reproduce(dataset, frame, variant=variant, device=device)
    if as_json:
        show(json.dumps(made.as_json()))
    else:
        for file in made.files:
            word = "same" if file.same else "MISSING" if file.found is None else "DIFFERENT"
            show((Painted(f"{word:9}", GOOD if file.same else BAD), f"  {file.path}"))
        recorded, now = made.devices
        if recorded != now:
            show_note(OTHER_DEVICE.format(recorded, now))
        changed = made.versions.items()
        show_notes(f"{name} was {recorded or 'absent'}, is {now or 'absent'}" for name, (recorded, now) in changed)
    if not made.same:
        raise typer.Exit(FINDINGS)

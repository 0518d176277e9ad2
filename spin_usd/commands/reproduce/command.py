"""`spin-usd reproduce`: makes a picture again from its provenance, and compares the files."""

import json

import typer

import spin_usd
from spin_usd.commands.reproduce.options import ReproduceOptions
from spin_usd.errors import FINDINGS
from spin_usd.options import run_with
from spin_usd.terminal.lines import BAD, GOOD, Painted, print_out, show_note, show_notes
from spin_usd.terminal.parameters import Json

OTHER_DEVICE = (
    "made on {}, and made again on {}: the image's bytes may differ, since each device rounds in its own way; labels "
    "always run on the CPU"
)


def reproduce(options: ReproduceOptions, *, as_json: Json = False) -> None:
    """Make one picture again from its provenance, and compare it with the dataset's files."""
    made = run_with(spin_usd.reproduce, options)
    if as_json:
        print_out(json.dumps(made.as_json()))
    else:
        for file in made.files:
            word = "same" if file.same else "MISSING" if file.found is None else "DIFFERENT"
            print_out((Painted(f"{word:9}", GOOD if file.same else BAD), f"  {file.path}"))
        recorded, now = made.devices
        if recorded != now:
            show_note(OTHER_DEVICE.format(recorded, now))
        changed = made.versions.items()
        show_notes(f"{name} was {recorded or 'absent'}, is {now or 'absent'}" for name, (recorded, now) in changed)
    if not made.same:
        raise typer.Exit(FINDINGS)

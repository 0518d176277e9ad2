"""`spin-usd measure`: the cost and the error of render settings."""

import json
from pathlib import Path

import typer
from msgspec import to_builtins

import spin_usd
from spin_usd.commands.measure.options import MeasureOptions
from spin_usd.errors import FINDINGS
from spin_usd.options import run_with
from spin_usd.terminal.lines import BAD, Painted, print_err, print_out, show_note
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown


def measure(context: typer.Context, options: MeasureOptions, *, as_json: Json = False) -> None:
    """Measure the cost and the error of render settings on a few pictures of a stage.

    Another run, for example with another --count or --seeds, replaces the results and renders only missing pictures.
    Another stage or variant needs another --out.
    """
    from spin_usd.accuracy.report import in_short
    from spin_usd.store.measurement_file import folder_of
    from spin_usd.store.stage_path import existing_stage

    with shown(context.obj["quiet"]) as progress:
        found = run_with(spin_usd.measure, options.telling(progress, show_note))
    folder = options.out or folder_of(existing_stage(Path(options.stage)))
    if as_json:
        print_out(json.dumps(to_builtins(found)))
    else:
        print_out(
            *in_short(found).split("\n"),
            f"{folder}   (measure.json, measure.md, measure.svg)",
        )
    for failure in found.failures:
        print_err((Painted("failed:", BAD), f" {failure.frame}: {failure.what}: {failure.reason}"))
    if found.failures:
        raise typer.Exit(FINDINGS)

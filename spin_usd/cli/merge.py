"""`spin-usd merge`: puts shards of a dataset into one folder."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

import spin_usd
from spin_usd.cli.arguments import options
from spin_usd.cli.output.lines import show, tell
from spin_usd.cli.output.progress import shown
from spin_usd.counted import counted
from spin_usd.errors import FINDINGS


def merge(
    context: typer.Context,
    *,
    shards: Annotated[list[Path], typer.Argument(metavar="SHARD", help="Datasets' folders, which stay as they are.")],
    out: Annotated[
        Path,
        typer.Option(
            help="The folder to put them into: a new one, or a dataset of the same stage. Run again, it goes on."
        ),
    ],
    copy: Annotated[
        bool, typer.Option("--copy", help="Copy files; they are linked (hard links) if not given.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Put datasets of one stage, such as the shards of a run, into one."""
    with shown(context.obj["quiet"]) as progress:
        report = spin_usd.merge(shards, out=out, copy=copy, on_progress=progress)
    if as_json:
        show(json.dumps(asdict(report)))
    else:
        added = f"{counted(report.added, 'picture')} added, {report.kept} already there"
        show(f"{out}   ({added}, in {report.seconds:.1f} s)")
    if report.missing:
        from spin_usd.dataset.shards.missing import missing_in_words

        for shard, count in report.missing.items():
            tell(missing_in_words(count, shard))
        raise typer.Exit(FINDINGS)

"""`spin-usd merge`: joins shards of a dataset in one folder."""

import json
from dataclasses import asdict

import typer

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.merge.options import MergeOptions
from spin_usd.errors import FINDINGS
from spin_usd.options import run_with
from spin_usd.terminal.lines import print_err, print_out
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown


def merge(context: typer.Context, options: MergeOptions, *, as_json: Json = False) -> None:
    """Join datasets of one stage, such as the shards of a run, into one dataset."""
    with shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.merge, options.telling(progress))
    if as_json:
        print_out(json.dumps(asdict(report)))
    else:
        added = f"{pluralise(report.added, 'picture')} added, {report.kept} already there"
        print_out(f"{options.out}   ({added}, in {report.seconds:.1f} s)")
    if report.missing:
        from spin_usd.planning.shard import missing_in_words

        for shard, count in report.missing.items():
            print_err(missing_in_words(count, shard))
        raise typer.Exit(FINDINGS)

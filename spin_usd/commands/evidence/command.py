"""`spin-usd evidence`: whether a dataset covers an operational domain, and its labels and pictures are right."""

import typer

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.evidence.options import EvidenceOptions
from spin_usd.errors import FINDINGS
from spin_usd.options import run_with
from spin_usd.terminal.lines import print_out, show_notes, show_report
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown
from spin_usd.terminal.tables import show_table

HEADINGS = ("dimension", "cells", "covered", "share", "holes")
CLAIMS = ("property", "set", "measured", "unit")


def evidence(context: typer.Context, options: EvidenceOptions, *, as_json: Json = False) -> None:
    """Show that a dataset covers an operational domain, that its labels are right, and where its pictures come from.

    The folder has a page that prints, the same as JSON, and a table of the pictures as Parquet. Holes in the coverage
    are not errors; a picture that comes out differently when it is made again is, and so are errors of check.
    """
    with shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.evidence, options.telling(progress))
    if as_json:
        show_report(report)
    else:
        rows = [
            [
                " and ".join(each.dimensions),
                str(each.cells),
                str(each.covered),
                f"{each.share:.1%}",
                str(len(each.holes)),
            ]
            for each in report.coverage
        ]
        show_table(HEADINGS, rows)
        claims = [
            [name, f"{each.claimed:.4g}", f"{each.measured:.4g}" if isinstance(each.measured, float) else "", each.unit]
            for name, each in report.calibration.items()
        ]
        show_table(CLAIMS, claims)
        again = sum(each.same for each in report.reproduced)
        print_out(f"made again: {again} of {pluralise(len(report.reproduced), 'picture')} with the same bytes")
        print_out(f"outside the domain: {pluralise(len(report.outside), 'picture')}")
        if report.fill:
            print_out(f"{report.fill}   (pictures for the holes, for author --sample)")
        print_out(f"{options.out}   (index.html, evidence.json, pictures.parquet)")
        show_notes(report.deviations)
    if report.wrong:
        raise typer.Exit(FINDINGS)

"""`spin-usd gap`: how far pictures of a stage are from real ones, of which part, and what would close it."""

from typing import TYPE_CHECKING, Any

import typer

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.gap.options import GapOptions
from spin_usd.options import run_with
from spin_usd.terminal.lines import print_out, show_notes, show_report
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown
from spin_usd.terminal.tables import show_table

if TYPE_CHECKING:
    from spin_usd.commands.gap.report import GapMeasure

HEADINGS = ("measure", "real", "ours", "fitted", "95 %", "unit")
PARTS = ("part", "pictures", "correlation", "fitted", "distance", "fitted")


def gap(context: typer.Context, options: GapOptions, *, as_json: Json = False) -> None:
    """Measure how far pictures of a stage are from real pictures of the same poses, and fit light, camera and surface.

    REAL is a folder of pictures: its own poses are read from a list in a known layout, or from --poses; otherwise the
    pictures have the names of the stage's frames. Figures are medians over the pictures; the interval is that of the
    real pictures, or of the pairs for measures of both. Grey is in steps of 8 bits.
    """
    with shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.gap, options.telling(progress))
    show_notes(report.notes)
    show_notes([f"{name} is left out: {why}" for name, why in report.left_out.items()])
    if as_json:
        show_report(report)
        return
    show_table(HEADINGS, [_row(name, of) for name, of in report.summary.items()])
    rows = [
        [
            name,
            str(part.pictures),
            *(_number(each) for of in (part.correlation, part.wasserstein) for each in _pair(of)),
        ]
        for name, part in report.parts.items()
    ]
    show_table(PARTS, rows)
    for name, fit in report.fits.items():
        for parameter, found in fit.parameters.items():
            between = f" ({_span(found.interval)})" if found.interval else ""
            print_out(f"{name}: {parameter} {found.value:.4g}{between} {found.unit}".rstrip())
    print_out(f"{options.out}   (index.html, gap.json; {pluralise(len(report.pictures), 'picture')})")
    if report.fitted_stage:
        print_out(f"{report.fitted_stage}   (the stage with the fits)")


def _row(name: str, of: "GapMeasure") -> list[str]:
    return [name, _number(of.real), *(_number(each) for each in _pair(of)), _span(of.interval), of.unit]


def _span(interval: Any) -> str:
    return f"{interval[0]:.4g} to {interval[1]:.4g}" if interval else ""


def _pair(of: "GapMeasure") -> tuple[object, object]:
    return of.ours, of.fitted


def _number(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else ""

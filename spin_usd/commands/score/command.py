"""`spin-usd score`: the errors of predicted poses, as SPEED, SPEED+ and BOP define them."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import typer

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.score.options import ScoreOptions
from spin_usd.options import run_with
from spin_usd.terminal.lines import print_out, show_notes, show_report
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown
from spin_usd.terminal.tables import show_table

if TYPE_CHECKING:
    from spin_usd.commands.score.report import ScoredErrors, ScoredModel
    from spin_usd.commands.score.shape_report import ShapeReport

SHAPE_HEADINGS = ("", "points", "m", "% of the diameter", "within 1 %")
HEADINGS = ("pictures", "count", "SPEED", "SPEED+", "median m", "p90 m", "median deg", "p90 deg")


def score(context: typer.Context, options: ScoreOptions, *, as_json: Json = False) -> None:
    """Score predicted poses by SPEED, SPEED+, ADD and BOP's recalls; or a reconstructed shape by its distances.

    Columns in m are errors of position, columns in deg errors of attitude: medians and 90th percentiles. SPEED is the
    score without thresholds, SPEED+ the score with the thresholds of its calibration.
    """
    from msgspec import UNSET

    from spin_usd.commands.score.shape_report import ShapeReport

    with shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.score, options.telling(progress))
    show_notes(report.notes)
    if as_json:
        show_report(report)
        return
    if isinstance(report, ShapeReport):
        show_table(SHAPE_HEADINGS, [*_shape_rows(report)])
        return
    rows = [_row(f"{each.by} {each.group}", each) for each in report.groups]
    show_table(HEADINGS, [*rows, _row("all", report.all)])
    if report.model is not UNSET:
        print_out(*_model(report.model))
    if report.missing:
        print_out(f"{pluralise(report.missing, 'picture')} without a usable prediction")
    if options.out:
        print_out(f"{options.out}   (index.html, score.json)")


def _shape_rows(report: "ShapeReport") -> Iterator[list[str]]:
    def row(name: str, metres: float, share: float, points: str = "") -> list[str]:
        return [name, points, f"{metres:.4g}", f"{100 * metres / report.diameter:.4g}", f"{share:.4g}"]

    for part in report.parts:
        yield row(f"completeness of {part.name}", part.completeness_m, part.recall, str(part.points))
    yield row("accuracy", report.accuracy_m, report.precision)
    yield row("completeness", report.completeness_m, report.recall)
    yield row("Chamfer, F-score", report.chamfer_m, report.f_score)
    if report.normal_consistency:
        yield ["normal consistency", "", "", "", f"{report.normal_consistency:.4g}"]
    if report.views:
        yield [f"views: PSNR {report.views.psnr or float('inf'):.4g} dB, SSIM {report.views.ssim:.4g}", "", "", "", ""]


def _row(name: str, errors: "ScoredErrors") -> list[str]:
    position, attitude = errors.position_m, errors.attitude_deg
    numbers = (
        *(errors.scores[each] for each in ("speed", "speedplus")),
        *(position[each] for each in ("median", "p90")),
        *(attitude[each] for each in ("median", "p90")),
    )
    return [name, str(errors.pictures), *(f"{number:.4g}" for number in numbers)]


def _model(model: "ScoredModel") -> list[str]:
    return [
        f"ADD {model.add_m['median']:.4g} m (found {100 * model.add_found:.1f} %), ADD-S "
        f"{model.add_s_m['median']:.4g} m (found {100 * model.add_s_found:.1f} %), diameter {model.diameter:.4g} m",
        f"BOP's recalls: MSSD {model.mssd_recall:.3f}, MSPD {model.mspd_recall:.3f}",
    ]

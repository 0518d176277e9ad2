"""The page of a comparison: its tables, a plot of each measure, and the pictures, the least alike first."""

from collections.abc import Iterator, Sequence
from html import escape
from typing import Any

import numpy as np
from msgspec import UNSET

from spin_usd.browser.report_page import figure_of, head, table
from spin_usd.commands.gap.report import GapMeasure, GapReport
from spin_usd.commands.gap.summary import Step

COLUMNS = 5
MORE_STYLE = """figure{margin:1em 0}figure div{display:flex;flex-wrap:wrap;gap:.5em}
.cell{position:relative;font-size:12px}.cell img{display:block;background:#000;max-width:100%}
.blink img+img{position:absolute;top:0;left:0;animation:blink 1.6s steps(1) infinite}
.difference img+img{position:absolute;top:0;left:0;mix-blend-mode:difference}
@keyframes blink{50%{opacity:0}}@media(prefers-reduced-motion:reduce){.blink img+img{animation:none;opacity:.5}}"""


def page_of(report: GapReport, steps: Sequence[Step]) -> str:
    """Return index.html, which needs no other file."""
    title = f"<h1>{escape(report.real)} beside {escape(report.stage)}</h1>"
    notes = [*report.notes, *(f"{name} is left out: {why}" for name, why in report.left_out.items())]
    said = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return "\n".join(
        (
            head("Gap", MORE_STYLE),
            title,
            said,
            "<h2>Measures</h2><p>Medians over the pictures, with 95 % intervals. Grey is in steps of 8 bits.</p>",
            _table(report.summary),
            *_fits(report),
            "<h2>Parts</h2>",
            _table({f"{name}: {which}": getattr(part, which) for name, part in report.parts.items() for which in BOTH}),
            "<h2>Distributions</h2>",
            _plots(report),
            *_pictures(report, steps),
        )
    )


BOTH = ("correlation", "wasserstein")


def _table(measures: dict[str, GapMeasure]) -> str:
    steps = list(dict.fromkeys(step for each in measures.values() for step in each.steps or ()))
    heads = ("", "real", "ours", *(f"after {step}" for step in steps), "95 %", "gap", "gap after fits", "unit", "")
    return table(heads, (_cells(name, each, steps) for name, each in measures.items()))


def _cells(name: str, each: GapMeasure, steps: Sequence[str]) -> tuple[str, ...]:
    after = [_text((each.steps or {}).get(step, UNSET)) for step in steps]
    gaps = [
        f"{_text(value)} {_span(span)}".strip()
        for value, span in ((each.gap, each.gap_interval), (each.fitted_gap, each.fitted_gap_interval))
    ]
    return (name, _text(each.real), _text(each.ours), *after, _span(each.interval), *gaps, each.unit, each.description)


def _fits(report: GapReport) -> Iterator[str]:
    if not report.fits:
        return
    rows: list[tuple[str, ...]] = []
    for fit, of in report.fits.items():
        if of.explained is not UNSET:
            rows.append((f"{fit}: share of the squared signal explained", f"{of.explained:.3f}", "", ""))
        rows += [
            (f"{fit}: {name}", f"{each.value:.4g}", _span(each.interval), each.unit)
            for name, each in of.parameters.items()
        ]
    yield "<h2>Fits</h2>"
    yield table(("", "value", "95 %", "unit"), rows)


def _plots(report: GapReport) -> str:
    """Return an SVG: each measure of the real pictures, ours and the fitted ones as points in columns."""
    names = [name for name in report.summary if any(name in each.real or name in each.ours for each in report.pictures)]
    kinds = ("real", "ours", "fitted") if report.fits else ("real", "ours")
    rows = -(-len(names) // COLUMNS)

    def draw(figure: Any) -> None:
        for place, name in enumerate(names, 1):
            axes = figure.add_subplot(rows, COLUMNS, place)
            for column, kind in enumerate(kinds):
                found = [each[name] for each in (getattr(picture, kind) for picture in report.pictures) if name in each]
                spread = np.linspace(-0.25, 0.25, len(found)) if len(found) > 1 else np.zeros(len(found))
                axes.plot(column + spread, found, ".", markersize=3)
            axes.set(title=name, ylabel=report.summary[name].unit[:24], xticks=range(len(kinds)), xticklabels=kinds)

    return figure_of((2.6 * COLUMNS, 2.0 * rows), draw)


def _pictures(report: GapReport, steps: Sequence[Step]) -> Iterator[str]:
    """Yield all pairs: real, ours, each after fits, both in turn, and their difference."""
    yield "<h2>Pictures</h2><p>The least alike first. On the right both in turn, and their difference.</p>"
    last = steps[-1].pictures
    order = sorted(report.pictures, key=lambda each: (each.fitted or each.ours).get("correlation", 0.0))
    for picture in order:
        real = steps[0].pictures[picture.name].shown[0]
        ours = {step.name: step.pictures[picture.name].shown[1] for step in steps}
        shown = last[picture.name].shown[1]
        cells: list[tuple[str, str, tuple[str, ...]]] = [
            ("real", "", (real,)),
            *((name, "", (each,)) for name, each in ours.items()),
            ("in turn", " blink", (real, shown)),
            ("difference", " difference", (real, shown)),
        ]
        likeness = (picture.fitted or picture.ours).get("correlation")
        said = picture.name if likeness is None else f"{picture.name}: correlation {likeness:.2f}"
        lights = ", ".join(f"{light.name} {light.strength:.3g}" for light in picture.lights)
        inside = "".join(
            f'<div class="cell{kind}">{escape(name)}' + "".join(map(_image, images)) + "</div>"
            for name, kind, images in cells
        )
        yield f"<figure><figcaption>{escape(said)}; {escape(lights)}</figcaption><div>{inside}</div></figure>"


def _image(jpeg: str) -> str:
    return f'<img alt="" src="data:image/jpeg;base64,{jpeg}">'


def _text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else ""


def _span(span: object) -> str:
    return f"({span[0]:.4g} to {span[1]:.4g})" if isinstance(span, list) else ""

"""The page of a comparison: its tables, a plot of each measure, and the pictures, the least alike first."""

import re
from collections.abc import Iterator, Sequence
from html import escape
from io import StringIO
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from msgspec import UNSET

from spin_usd.commands.gap.report import GapMeasure, GapReport
from spin_usd.commands.gap.summary import Step

STYLE: dict[Any, Any] = {"svg.fonttype": "none", "svg.hashsalt": "spin_usd", "font.size": 8}
COLUMNS = 5
HEAD = """<!doctype html><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>Gap</title>
<style>:root{color-scheme:light dark}body{font:14px sans-serif;margin:2em;max-width:85em}table{border-collapse:collapse}
td,th{padding:.2em .8em;text-align:right}td:first-child,th:first-child,td:last-child,th:last-child{text-align:left}
.scroll{overflow-x:auto}figure{margin:1em 0}figure div{display:flex;flex-wrap:wrap;gap:.5em}
.cell{position:relative;font-size:12px}.cell img{display:block;background:#000;max-width:100%}
.blink img+img{position:absolute;top:0;left:0;animation:blink 1.6s steps(1) infinite}
.difference img+img{position:absolute;top:0;left:0;mix-blend-mode:difference}
@keyframes blink{50%{opacity:0}}@media(prefers-reduced-motion:reduce){.blink img+img{animation:none;opacity:.5}}
svg{background:#fff;max-width:100%;height:auto}</style>
"""


def page_of(report: GapReport, steps: Sequence[Step]) -> str:
    """Return index.html, which needs no other file."""
    title = f"<h1>{escape(report.real)} beside {escape(report.stage)}</h1>"
    notes = [*report.notes, *(f"{name} is left out: {why}" for name, why in report.left_out.items())]
    said = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return "\n".join(
        (
            HEAD,
            title,
            said,
            "<h2>Measures</h2><p>Medians over the pictures, with 95 % intervals. Grey is in steps of 8 bits.</p>",
            *_table(report.summary),
            *_fits(report),
            "<h2>Parts</h2>",
            *_table(
                {f"{name}: {which}": getattr(part, which) for name, part in report.parts.items() for which in BOTH}
            ),
            "<h2>Distributions</h2>",
            _plots(report),
            *_pictures(report, steps),
        )
    )


BOTH = ("correlation", "wasserstein")


def _table(measures: dict[str, GapMeasure]) -> Iterator[str]:
    steps = list(dict.fromkeys(step for each in measures.values() for step in each.steps or ()))
    heads = ("", "real", "ours", *(f"after {step}" for step in steps), "95 %", "gap", "gap after fits", "unit", "")
    yield '<div class="scroll"><table><tr>' + "".join(f"<th>{head}</th>" for head in heads) + "</tr>"
    for name, each in measures.items():
        after = [_text((each.steps or {}).get(step, UNSET)) for step in steps]
        gaps = [
            f"{_text(value)} {_span(span)}".strip()
            for value, span in ((each.gap, each.gap_interval), (each.fitted_gap, each.fitted_gap_interval))
        ]
        cells = (name, _text(each.real), _text(each.ours), *after, _span(each.interval), *gaps, each.unit)
        yield "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in (*cells, each.description)) + "</tr>"
    yield "</table></div>"


def _fits(report: GapReport) -> Iterator[str]:
    if not report.fits:
        return
    yield "<h2>Fits</h2><table><tr><th></th><th>value</th><th>95 %</th><th>unit</th></tr>"
    for fit, of in report.fits.items():
        if of.explained is not UNSET:
            yield f"<tr><td>{fit}: share of the squared signal explained</td><td>{of.explained:.3f}</td></tr>"
        for name, each in of.parameters.items():
            cells = (f"{fit}: {name}", f"{each.value:.4g}", _span(each.interval), each.unit)
            yield "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
    yield "</table>"


def _plots(report: GapReport) -> str:
    """Return an SVG: each measure of the real pictures, ours and the fitted ones as points in columns."""
    names = [name for name in report.summary if any(name in each.real or name in each.ours for each in report.pictures)]
    kinds = ("real", "ours", "fitted") if report.fits else ("real", "ours")
    rows, text = -(-len(names) // COLUMNS), StringIO()
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=(2.6 * COLUMNS, 2.0 * rows), facecolor="white", layout="constrained")
        FigureCanvasSVG(figure)
        for place, name in enumerate(names, 1):
            axes = figure.add_subplot(rows, COLUMNS, place)
            for column, kind in enumerate(kinds):
                found = [each[name] for each in (getattr(picture, kind) for picture in report.pictures) if name in each]
                spread = np.linspace(-0.25, 0.25, len(found)) if len(found) > 1 else np.zeros(len(found))
                axes.plot(column + spread, found, ".", markersize=3)
            axes.set(title=name, ylabel=report.summary[name].unit[:24], xticks=range(len(kinds)), xticklabels=kinds)
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return re.sub(r"^.*?(?=<svg)", "", text.getvalue(), flags=re.DOTALL)


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

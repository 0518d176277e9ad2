"""The page of the evidence: data, labels, coverage, traceability, verification; it prints in light and in dark.

These are the subjects that ESA's handbook ECSS-E-HB-40-02 asks a user of machine learning in flight to show of data.
"""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

from msgspec import UNSET, to_builtins

from spin_usd.browser.report_page import head, table
from spin_usd.commands.evidence.domain import UNITS, Domain
from spin_usd.commands.evidence.report import CellCoverage, EvidenceReport

MOST_ROWS = 60  # of a table of holes, or of pictures outside; evidence.json has all
MOST_CELLS = 400  # of a map
STYLE = """h2{border-bottom:1px solid}h2,h3{break-after:avoid}tr{break-inside:avoid}td{overflow-wrap:anywhere}
.map td{text-align:center;min-width:1.5em;background:color-mix(in srgb,Canvas,#2a9d5c calc(var(--n)*100%))}
.map td.hole{outline:2px solid #c33;outline-offset:-2px}*{print-color-adjust:exact;-webkit-print-color-adjust:exact}
@media print{body{margin:0;font-size:11px}.scroll{overflow:visible}}"""


def page_of(report: EvidenceReport, domain: Domain) -> str:
    """Return index.html, which needs no other file."""
    title = report.title or f"Evidence for {report.datasets[0]}"
    outside = [{"picture": name, "in": found} for name, found in report.outside.items()]
    sources, quality = report.sources, report.quality.items()
    files = [{"file": name, "sha256": found} for name, found in sources.files.items()]
    software = [
        {"library": name, "version": found, "licence": sources.licences.get(name, "")}
        for name, found in sources.versions.items()
    ]
    figures = [{"figure": name, "value": value} for _, found in quality for name, value in found.items()]
    parts = (
        head(title, STYLE),
        f"<h1>{escape(title)}</h1><h2>Data</h2>",
        _table([{"datasets": report.datasets, "pictures": report.pictures, "by": list(sources.renderers)}]),
        "<h3>Outside the domain</h3>" + _table(outside[:MOST_ROWS]),
        "<h2>Labels</h2><p>Bounds of the errors in this set.</p>" + _table(_named(report.labels, "label")),
        f"<h2>Coverage</h2><p>A cell needs {report.least}. The number in a cell is that of its pictures.</p>",
        *(part for each in report.coverage for part in _coverage(each, domain)),
        f"<h3>By dqm-ml-core {escape(report.quality_by)}</h3>" + _table(figures),
        "<h2>Traceability</h2><h3>Stages</h3>" + _table([{"sha256": each} for each in sources.stages]),
        "<h3>Layers, models and textures</h3>" + _table(files) + "<h3>Software</h3>" + _table(software),
        "<h2>Verification</h2><h3>Pictures made again</h3>" + _table(report.reproduced),
        "<h3>Findings of check</h3>" + _table(report.findings),
        "<h3>Camera and detector, by test charts</h3>" + _table(_named(report.calibration, "property")),
        "<h3>Gap to real pictures</h3>" + _table(_named(report.gap, "measure")) if report.gap is not UNSET else "",
        "<h2>Known deviations</h2>" + _table([{"": each} for each in report.deviations]),
    )
    return "\n".join(parts)


def _coverage(coverage: CellCoverage, domain: Domain) -> Iterator[str]:
    names = " and ".join(f"{name}, {UNITS[name]}" if UNITS[name] else name for name in coverage.dimensions)
    covered = f"{coverage.share:.1%} of {coverage.cells} cells are covered; {coverage.unknown} pictures have no value."
    yield f"<h3>{escape(names)}</h3><p>{covered}</p>"
    if coverage.cells <= MOST_CELLS:
        yield _map(coverage, domain)
    if coverage.holes:
        yield _table([{**hole.bounds, "pictures": hole.pictures} for hole in coverage.holes[:MOST_ROWS]])


def _map(coverage: CellCoverage, domain: Domain) -> str:
    """Return the cells as a table with their numbers of pictures: of a pair the first dimension runs down."""
    most, across = max([*coverage.counts, 1]), domain.dimensions[coverage.dimensions[-1]].count
    cells = [f'<td{" class=hole" * (n < domain.pictures)} style="--n:{n / most:.2f}">{n}</td>' for n in coverage.counts]
    rows = ("".join(cells[start : start + across]) for start in range(0, len(cells), across))
    return '<div class="scroll"><table class="map">' + "".join(f"<tr>{row}</tr>" for row in rows) + "</table></div>"


def _named(found: Any, by: str) -> list[dict[str, Any]]:
    return [{by: name, **row} for name, row in to_builtins(found).items()]


def _table(rows: Sequence[Any]) -> str:
    """Return a table of objects by their fields."""
    listed: list[Mapping[str, Any]] = to_builtins(rows)
    if not listed:
        return "<p>None.</p>"
    heads = list(dict.fromkeys(name for row in listed for name in row))
    return table(heads, ([_text(row.get(name, "")) for name in heads] for row in listed))


def _text(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return (" to " if all(isinstance(each, float) for each in value) else ", ").join(map(_text, value))
    return (
        ", ".join(f"{name}: {_text(each)}" for name, each in value.items()) if isinstance(value, dict) else str(value)
    )

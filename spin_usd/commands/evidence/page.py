"""The page of the evidence: data, labels, coverage, traceability, verification; it prints in light and in dark.

These are the subjects that ESA's handbook ECSS-E-HB-40-02 asks a user of machine learning in flight to show of data.
"""

from collections.abc import Iterator
from html import escape

from spin_usd.browser.report_page import head, table
from spin_usd.commands.evidence.domain import UNITS, Domain
from spin_usd.commands.evidence.report import CellCoverage, EvidenceReport, Hole

SHOWN_HOLES = 40  # of each dimension or pair, and pictures outside; evidence.json has all
SHOWN_CELLS = 400  # of a map: larger ones are in evidence.json alone
STYLE = """h2{border-bottom:1px solid}h2,h3{break-after:avoid}tr{break-inside:avoid}code{word-break:break-all}
.map td{text-align:center;min-width:1.5em;background:color-mix(in srgb,Canvas,#2a9d5c calc(var(--n)*100%))}
.map td.hole{outline:2px solid #c33;outline-offset:-2px}*{print-color-adjust:exact;-webkit-print-color-adjust:exact}
@media print{body{margin:0;font-size:11px}.scroll{overflow:visible}}"""


def page_of(report: EvidenceReport, domain: Domain) -> str:
    """Return index.html, which needs no other file."""
    title = report.title or f"Evidence for {report.datasets[0]}"
    deviations = "".join(f"<li>{escape(each)}</li>" for each in report.deviations)
    return "\n".join(
        (
            head(title, STYLE),
            f"<h1>{escape(title)}</h1>",
            *_data(report),
            *_labels(report),
            *_coverage(report, domain),
            *_traceability(report),
            *_verification(report),
            f"<h2>Known deviations</h2><ul>{deviations}</ul>",
        )
    )


def _data(report: EvidenceReport) -> Iterator[str]:
    yield "<h2>Data</h2>"
    rows = [
        ("datasets", ", ".join(report.datasets)),
        ("pictures", str(report.pictures)),
        ("pictures outside the domain", str(len(report.outside))),
        ("renderers", ", ".join(f"{name} ({count})" for name, count in report.sources.renderers.items())),
    ]
    yield table(("", ""), rows)
    if report.outside:
        some = [(name, ", ".join(found)) for name, found in report.outside.items()]
        yield table(("outside the domain", "in"), some[:SHOWN_HOLES])


def _labels(report: EvidenceReport) -> Iterator[str]:
    yield "<h2>Labels</h2><p>Bounds of the errors in this set.</p>"
    rows = [(name, f"{each.bound:.2g}", each.unit, each.reason) for name, each in report.labels.items()]
    yield table(("label", "bound", "unit", "reason"), rows)


def _coverage(report: EvidenceReport, domain: Domain) -> Iterator[str]:
    needs = f"{report.least} picture{'s' * (report.least != 1)}"
    yield f"<h2>Coverage</h2><p>A cell is covered by {needs} or more. The number in a cell is that of its pictures.</p>"
    rows = [
        (_name(each), str(each.cells), str(each.covered), f"{each.share:.1%}", str(each.unknown))
        for each in report.coverage
    ]
    yield table(("dimension", "cells", "covered", "share", "pictures without a value"), rows)
    for each in report.coverage:
        yield f"<h3>{escape(_name(each))}</h3>"
        if each.cells <= SHOWN_CELLS:
            yield _map(each, domain)
        if each.holes:
            holes = [(_bounds(hole), str(hole.pictures)) for hole in each.holes[:SHOWN_HOLES]]
            yield table((f"holes ({len(each.holes)})", "pictures"), holes)
    yield f"<h3>By dqm-ml-core {escape(report.quality_by)}</h3>"
    yield table(
        ("dimension", "figure", "value"),
        [(name, figure, f"{value:.4g}") for name, found in report.quality.items() for figure, value in found.items()],
    )


def _map(coverage: CellCoverage, domain: Domain) -> str:
    """Return the cells as a table with their numbers of pictures: of a pair the first dimension runs down."""
    most, across = max([*coverage.counts, 1]), domain.dimensions[coverage.dimensions[-1]].count
    few = domain.pictures
    rows = [
        "".join(f'<td{" class=hole" * (n < few)} style="--n:{n / most:.2f}">{n}</td>' for n in row)
        for row in (coverage.counts[i : i + across] for i in range(0, coverage.cells, across))
    ]
    return '<div class="scroll"><table class="map">' + "".join(f"<tr>{row}</tr>" for row in rows) + "</table></div>"


def _name(coverage: CellCoverage) -> str:
    return " and ".join(f"{name}, {UNITS[name]}" if UNITS[name] else name for name in coverage.dimensions)


def _bounds(hole: Hole) -> str:
    return "; ".join(
        f"{name} {each}" if isinstance(each, str) else f"{name} {each[0]:.4g} to {each[1]:.4g}"
        for name, each in hole.bounds.items()
    )


def _traceability(report: EvidenceReport) -> Iterator[str]:
    sources = report.sources
    yield "<h2>Traceability</h2><h3>Stages</h3>"
    yield "".join(f"<p><code>{each}</code></p>" for each in sources.stages)
    yield "<h3>Layers, models and textures</h3>"
    yield table(("file", "sha256"), [(name, digest) for name, found in sources.files.items() for digest in found])
    yield "<h3>Software</h3>"
    versions = [(name, ", ".join(found), sources.licences.get(name, "")) for name, found in sources.versions.items()]
    yield table(("library", "version", "licence"), versions)


def _verification(report: EvidenceReport) -> Iterator[str]:
    yield "<h2>Verification</h2><h3>Pictures made again</h3>"
    made = [
        (f"{each.variant}/{each.frame}", "same" if each.same else "different", ", ".join(each.different))
        for each in report.reproduced
    ]
    yield table(("picture", "bytes", "different files"), made)
    yield "<h3>Findings of check</h3>"
    found = [(each.severity, each.code, each.where, each.message) for each in report.findings]
    yield table(("severity", "rule", "where", "finding"), found) if found else "<p>None.</p>"
    if report.calibration:
        yield "<h3>Camera and detector, by test charts</h3>"
        yield table(
            ("property", "set", "measured", "unit", ""),
            [
                (name, f"{each.claimed:.4g}", _text(each.measured), each.unit, each.description)
                for name, each in report.calibration.items()
            ],
        )
    if isinstance(report.gap, dict):
        yield "<h3>Gap to real pictures</h3>"
        names = ("real", "ours", "fitted", "gap")
        rows = [(name, *(_text(of.get(each)) for each in names)) for name, of in report.gap.items()]
        yield table(("measure", *names), rows)


def _text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else ""

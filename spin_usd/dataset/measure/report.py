"""A measurement as files for people: measure.md, its tables, and measure.svg, its plot."""

from functools import partial
from pathlib import Path

from spin_usd.dataset.measure.plot import plot
from spin_usd.dataset.store import write_atomically
from spin_usd.measuring.measurement import Measurement
from spin_usd.measuring.report import in_full

PLOT = "measure.svg"


def write_report(folder: Path, measurement: Measurement) -> None:
    """Into `folder`, over what is there. Raises OutputError."""
    shown = f"{in_full(measurement)}\n![Error against CPU seconds]({PLOT})\n"
    for name, text in (("measure.md", shown), (PLOT, plot(measurement))):
        write_atomically(folder / name, partial(_write, text))


def _write(text: str, path: Path) -> None:
    path.write_text(text, encoding="utf-8")

"""A measurement as files for people: measure.md, its tables, and measure.svg, its plot."""

from pathlib import Path

from spin_usd.accuracy.measurement import Measurement
from spin_usd.accuracy.report import in_full
from spin_usd.dataset.measure.plot import plot
from spin_usd.dataset.store.atomic import write_text
from spin_usd.files.folder import Folder

TABLES, PLOT = "measure.md", "measure.svg"


def write_report(folder: Path, measurement: Measurement, *, work: Path) -> None:
    """Write both files into `folder`, over what is there. Raises OutputError."""
    shown = f"{in_full(measurement)}\n![Error against CPU seconds]({PLOT})\n"
    for name, text in ((TABLES, shown), (PLOT, plot(measurement))):
        write_text(Folder(folder), name, text, work=work)

"""The block of a graphics processor's figures, made of what `tools/bench device` measured."""

from pathlib import Path

from benchmarks import device as bench
from documents.cost import figures_of


def device(folder: Path) -> str:
    """Return what light costs on a graphics processor and on the CPU of the same machine."""
    return bench.table(figures_of(folder, "device"))

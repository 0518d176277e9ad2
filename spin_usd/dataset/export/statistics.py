"""Statistics of an export's pictures, for its card."""

from array import array
from collections.abc import Iterator, Mapping

import numpy as np

from spin_usd.arrays import Float

BANDS, SECTORS = 6, 12  # of equal heights and azimuths: cells of equal area
ROWS = {
    "range": "range of the target, m",
    "turn": "rotation from body axes to camera axes, degrees",
    "sun": "Sun to camera as seen from the target, degrees",
    "visible": "visible fraction of the target",
}


def statistics_table(columns: Mapping[str, array[float]]) -> str:
    """Return a table in Markdown of least, median, mean and greatest of each column that has numbers."""
    lines = ["| | least | median | mean | greatest |", "| --- | --- | --- | --- | --- |", *_rows(columns)]
    return "\n".join(lines)


def _rows(columns: Mapping[str, array[float]]) -> Iterator[str]:
    for name, words in ROWS.items():
        numbers = known(columns[name])
        if len(numbers):
            shown = (numbers.min(), np.median(numbers), numbers.mean(), numbers.max())
            yield f"| {words} | {' | '.join(f'{number:.4g}' for number in shown)} |"


def views(columns: Mapping[str, array[float]]) -> str:
    """Say from how many directions the target is seen, of cells of equal area around it."""
    azimuth, height = np.array(columns["azimuth"]), np.array(columns["height"])
    band = np.clip((height + 1) / 2 * BANDS, 0, BANDS - 1).astype(int)
    sector = np.clip((azimuth + 180) / 360 * SECTORS, 0, SECTORS - 1).astype(int)
    seen = len(np.unique(band * SECTORS + sector))
    return f"The camera sees the target from {seen} of {BANDS * SECTORS} cells of equal area around it."


def known(column: array[float]) -> Float:
    """Return the numbers of a column that are not NaN."""
    numbers = np.array(column)
    found: Float = numbers[~np.isnan(numbers)]
    return found

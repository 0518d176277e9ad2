"""A few numbers in place of many: median, least and most, and a straight line through points."""

import statistics
from collections.abc import Sequence

import numpy as np


def spread(values: Sequence[float]) -> dict[str, float]:
    return {
        "median": round(statistics.median(values), 5),
        "least": round(min(values), 5),
        "most": round(max(values), 5),
    }


def shown(values: dict[str, float]) -> str:
    """Write it as a table has it: `1.23 (1.10 to 1.60)`, or the number alone where there is no other."""
    ends = f"{values['least']:.3g} to {values['most']:.3g}"
    return f"{values['median']:.3g}" + (f" ({ends})" if values["least"] < values["most"] else "")


def line(x: Sequence[float], y: Sequence[float]) -> dict[str, float]:
    """Return the straight line that fits best: `slope` and `intercept`, and the largest deviation, `off`, as a share of
    the largest y."""
    slope, intercept = np.polyfit(x, y, 1)
    off = np.abs(np.asarray(y) - (slope * np.asarray(x) + intercept)).max() / max(y)
    return {"slope": float(f"{slope:.4g}"), "intercept": float(f"{intercept:.4g}"), "off": round(float(off), 4)}

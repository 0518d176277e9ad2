"""A few numbers in place of many: median, least and most."""

import statistics
from collections.abc import Sequence


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

"""The block made of tools/figures/extremes.json, which `tools/report_extremes` writes."""

import json
from pathlib import Path
from typing import Any

from spin_usd.accuracy.tables import in_markdown, percent

LABELS = {"depth": "depth, of itself", "body": "body point, of the target's radius", "reprojection": "reprojection, px"}
SHOWN = ("median", "p99_9", "worst")


def extremes(folder: Path) -> str:
    """Return the largest errors of any case of each extreme, by either pass."""
    found = [each for each in json.loads((folder / "extremes.json").read_text()) if "extreme" in each]
    rows = []
    for extreme in dict.fromkeys(each["extreme"] for each in found):
        cases = [each for each in found if each["extreme"] == extreme]
        most = max(case[label]["of_bound"] for case in cases for label in LABELS)
        cells = [_largest([case[label] for case in cases]) for label in LABELS]
        rows.append([extreme, str(len({case["case"] for case in cases})), *cells, percent(most)])
    return in_markdown(("extreme", "cases", *LABELS.values(), "of its bound, at most"), rows)


def _largest(errors: list[dict[str, Any]]) -> str:
    return " · ".join(f"{max(each[name] for each in errors):.1e}" for name in SHOWN)

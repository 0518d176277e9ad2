"""The block made of tools/figures/cluster.json, which `tools/simulate_cluster STAGE --json` prints."""

import json
from pathlib import Path

from documents.marked import NotMeasuredError
from simulate_cluster import table


def cluster(folder: Path) -> str:
    """Return what a run on many machines would take."""
    file = folder / "cluster.json"
    if not file.is_file():
        raise NotMeasuredError(f"run tools/simulate_cluster STAGE --every 30 --json > {file}")
    return table(json.loads(file.read_text()))

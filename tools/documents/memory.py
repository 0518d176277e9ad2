"""The block made of tools/figures/memory.json, which `tools/try_memory --json` writes."""

import json
from pathlib import Path
from typing import Any

from documents.marked import NotMeasuredError, prose

from spin_usd.accuracy.tables import in_markdown


def memory(folder: Path) -> str:
    """Return how the memory of a run's processes grows with its pictures."""
    file = folder / "memory.json"
    if not file.is_file():
        raise NotMeasuredError(f"run tools/try_memory --json {file}")
    found: dict[str, dict[str, Any]] = json.loads(file.read_text())
    rows = [
        [renderer, f"{of['pictures']:,}", str(of["variants"]), *(_slope(of, name) for name in ("supervisor", "worker"))]
        for renderer, of in found.items()
    ]
    intro = (
        "Memory as pictures are made: MB more for 1,000 pictures more, by a line through what one worker and its "
        "supervisor held (resident set) over all but the first quarter of small pictures, each with its own light. "
        "Blender's worker keeps about 18 kB of each picture whose pose is another; one that holds more than its share "
        "of the machine's memory is replaced after its picture."
    )
    headings = ("renderer", "pictures", "variants", "supervisor", "worker")
    return f"{prose(intro)}\n\n{in_markdown(headings, rows)}\n![Memory by pictures finished](../images/memory.png)"


def _slope(of: dict[str, Any], name: str) -> str:
    return f"{of['slopes'][name]:+.2f}"

"""The outcomes of models by others as a table in Markdown."""

import json
from typing import Any

HEAD = (
    "| file | author | check | render | faces | size, m | source's, m | Blender's, m | silhouette IoU · brightness |\n"
    "| --- | --- | --- | --- | ---: | --- | --- | --- | --- |\n"
)


def table(outcomes: list[dict[str, Any]]) -> str:
    """A row a file."""
    return HEAD + "".join(row(outcome) for outcome in outcomes)


def row(outcome: dict[str, Any]) -> str:
    ours, blender = outcome.get("ours") or {}, outcome.get("blender") or {}
    source = outcome.get("source")
    cells = [
        outcome["file"],
        authored(outcome["author"]),
        findings(outcome.get("check")),
        step(outcome.get("render")),
        f"{ours.get('faces', '')}",
        size(ours.get("bounds")),
        size([source["low"], source["high"]]) if source else outcome.get("source_error", ""),
        size(blender.get("bounds")),
        beside(blender),
    ]
    return "| " + " | ".join(str(cell).replace("|", "/").replace("\n", " ") for cell in cells) + " |\n"


def authored(step: dict[str, Any]) -> str:
    if step["exit"]:
        return f"{step['exit']}: {said(step)}"
    notes = json.loads(step["out"])["notes"]
    return "ok" + (f"; {len(notes)} notes: {notes[0]}" if notes else "")


def findings(step: dict[str, Any] | None) -> str:
    if step is None:
        return ""
    if step["exit"] not in (0, 1):
        return f"{step['exit']}: {said(step)}"
    return ": ".join([str(step["exit"]), *([", ".join(step["findings"])] if step["findings"] else [])])


def step(done: dict[str, Any] | None) -> str:
    return "" if done is None else "ok" if done["exit"] == 0 else f"{done['exit']}: {said(done)}"


def said(step: dict[str, Any]) -> str:
    lines = [line for line in step["said"].splitlines() if line.strip()]
    return lines[-1][:200] if lines else "nothing said"


def size(bounds: Any) -> str:
    """Length by width by height."""
    return " x ".join(f"{b - a:.4g}" for a, b in zip(*bounds, strict=True)) if bounds else ""


def beside(blender: dict[str, Any]) -> str:
    """How like Blender's picture ours is, or why there is none of its."""
    if "brightness" not in blender:
        return str(blender.get("error", ""))
    return f"{blender['silhouette_iou']:.3f} · {blender['brightness']:.2f}"

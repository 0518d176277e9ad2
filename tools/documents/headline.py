"""The few figures at the top of the benchmarks, from tools/figures."""

import json
from pathlib import Path

from benchmarks.frames import CROPPED_SCRIPT, DEFAULT
from benchmarks.frames import LABELS as LABELS_ONLY
from benchmarks.spread import shown
from documents.accuracy import measurements
from documents.cost import figures_of
from documents.labels import LABELS
from documents.marked import prose
from documents.training import rows_of

from spin_usd.accuracy.front import Criterion
from spin_usd.accuracy.report import by_name
from spin_usd.accuracy.tables import percent

FULL = "plain bpy script, full frame"
QUALITY = "--quality standard"


def headline(folder: Path) -> str:
    """Return how exact the labels are, what a picture takes, how far off its light is, and what trains well: one item
    each."""
    items = (_labels(folder), _cost(folder), _noise(folder), _training(folder))
    return "\n".join(prose(f"- {item}").replace("\n", "\n  ") for item in items if item)


def _labels(folder: Path) -> str:
    cases = [each for each in json.loads((folder / "extremes.json").read_text()) if "extreme" in each]
    worst = [f"{max(case[name]['worst'] for case in cases):.1e} {unit}" for name, unit in _UNITS.items()]
    count = len({(case["extreme"], case["case"]) for case in cases})
    return (
        f"**Labels**: the worst pixel of {count} extreme cases (range, focal length, lens, grazing and needle faces) "
        f"is off by {worst[0]} in depth, {worst[1]} in dense pose, {worst[2]} in reprojection."
    )


_UNITS = dict(zip(LABELS, ("of its value", "of the target's radius", "px"), strict=True))


def _cost(folder: Path) -> str:
    found = figures_of(folder, "frames")
    cpu = {name: shown(taken["cpu_s"]) for name, taken in found["makers"].items()}
    return (
        f"**Speed**: a picture of {'x'.join(map(str, found['frame']))} with all labels takes {cpu[DEFAULT]} seconds "
        f"of one core without a GPU, median (least to most); labels alone {cpu[LABELS_ONLY]} s. "
        "A plain bpy script without labels takes, at "
        f"{found['samples']} samples, {cpu[FULL]} s for the full frame, {cpu[CROPPED_SCRIPT]} s for the target's "
        "box alone."
    )


def _noise(folder: Path) -> str:
    """Return what `QUALITY` comes to, "" where that was not measured."""
    errors = []
    for stage, found in measurements(folder).items():
        outcome = dict(by_name(found))[QUALITY]
        if outcome is not None:
            errors.append(f"{percent(outcome.error(Criterion.LIGHT).expected)} on `{stage}`")
    if not errors:
        return ""
    said = f"with `{QUALITY}`, the default, the target's pixels are off by {', '.join(errors)} (root mean square)"
    return f"**Light**: {said}."


def _training(folder: Path) -> str:
    """Return what rich pictures and several appearances are worth to a network."""
    rows = {row.name: row for row in rows_of(folder, "proxy")}
    scores = {
        name: " and ".join(f"{rows[name].score(bed)[0]:.2f}" for bed in ("sunlamp", "lightbox")) for name in TAUGHT
    }
    said = ", ".join(f"{score} {TAUGHT[name]}" for name, score in scores.items())
    return (
        "**Training**: a small network's SPEED+ score on two sets under light that it has not seen (sunlamp and "
        f"lightbox) is {said}; how well the pictures are rendered counts for much less "
        "([what was tried](training.md))."
    )


TAUGHT = {
    "plain": "after plain pictures",
    "rich": "after rich ones",
    "rich_3": "after three appearances of each pose",
}

"""Blocks made of tools/figures/bench.json, which `tools/bench NAME --json` writes."""

import json
from pathlib import Path
from typing import Any

from benchmarks import predict
from benchmarks.frames import OURS
from benchmarks.spread import shown
from documents.marked import NotMeasuredError, prose

from spin_usd.accuracy.tables import in_markdown, number, percent


def figures_of(folder: Path, name: str) -> dict[str, Any]:
    """What the benchmark `name` measured. Raises NotMeasuredError."""
    file = folder / "bench.json"
    found: dict[str, dict[str, Any]] = json.loads(file.read_text()) if file.is_file() else {}
    if name not in found:
        raise NotMeasuredError(f"run tools/bench {name} --json {file}")
    return found[name]


def machine(folder: Path) -> str:
    """What all of the costs were measured on."""
    found = figures_of(folder, "frames")
    of, (width, height) = found["machine"], found["frame"]
    where = f"{of['cores']} cores of an {of['architecture'].replace('_', '-')} server without a GPU"
    of_what = f"{width}x{height}, the SPEED+ lens, a Tango mesh of {found['faces']:,} faces"
    return prose(f"Measured on {where}, {of_what}. All figures can be taken again: `tools/bench`.")


def peers(folder: Path) -> str:
    """Seconds of a picture, by spin_usd and by others."""
    found = figures_of(folder, "frames")
    rows = []
    for name, taken in found["makers"].items():
        beside = "" if name == OURS else shown(taken["over_ours"])
        rows.append([name, shown(taken["wall_s"]), shown(taken["cpu_s"]), beside])
    intro = (
        f"Seconds a picture at {found['samples']} samples, over {found['pictures']} poses, all in turn, held open, "
        "until the files are there: median (least to most). The box that the target can cover is "
        f"{percent(found['box_share']['median'])} of the frame (median)."
    )
    names = ", ".join(found["left_out"])
    failed = f"Did not work there: {names}. Of a peer's variants the fastest that works is shown."
    lacking = f"\n{prose(failed)}\n" if found["left_out"] else ""
    headings = ("", "wall clock", "processor", "times spin_usd's wall clock")
    gain = (
        "The gain is in what is not rendered: most where the target is small, least in close-ups. "
        "What is cropped above has neither labels nor a frame around it."
    )
    return f"{prose(intro)}\n\n{in_markdown(headings, rows)}{lacking}\n{prose(gain)}"


def label_costs(folder: Path) -> str:
    """What each label takes."""
    found = figures_of(folder, "labels")
    width, height = found["frame"]
    intro = (
        f"Seconds of one core for each label at {width}x{height}, before files are written, over {found['pictures']} "
        f"poses of which Tango covers {percent(found['target_share']['median'])} (median): median (least to most). "
        "What labels share, such as normals, counts for the first that takes it."
    )
    rows = [[kind, shown(taken)] for kind, taken in (*found["seconds"].items(), ("in all", found["in_all"]))]
    return f"{prose(intro)}\n\n{in_markdown(('', 'seconds'), rows)}"


def growth(folder: Path) -> str:
    """What one more of anything costs a run."""
    found = figures_of(folder, "growth")
    rows = []
    for name, sweep in found["sweeps"].items():
        values, fit = [row[name] for row in sweep["rows"]], sweep["cpu"]
        of = [f"{values[0]:,} to {values[-1]:,}{' wide' if name == 'width' else ''}"]
        rows.append([sweep["against"], *of, f"{fit['slope']:.2g}", number(fit["intercept"]), percent(fit["off"])])
    base = ", ".join(f"{name} {value:,}" for name, value in found["base"].items())
    headings = ("", "from, to", "CPU s for one more", "CPU s for none", "furthest from the line")
    intro = f"How the cost of a run grows, one number at a time changed of {base}:"
    return f"{prose(intro)}\n\n{in_markdown(headings, rows)}"


def predicted(folder: Path) -> str:
    """What plan said, beside what was."""
    found = figures_of(folder, "predict")
    rows = [
        [
            f"{case['stage']}, `{case['effort']}`",
            number(case["predicted_s"]),
            shown(case["taken_s"]),
            percent(case["predicted_over_taken"] - 1),
        ]
        for case in found["cases"]
    ]
    worst = max(abs(case["predicted_over_taken"] - 1) for case in found["cases"])
    within = f"within {percent(predict.BOUND)}" if worst <= predict.BOUND else f"up to {percent(worst)} off"
    headings = ("stage", "planned, s", "taken, s", "off")
    return f"What `plan` says a run takes, {within}:\n\n{in_markdown(headings, rows)}"

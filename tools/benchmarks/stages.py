"""Measure speed against accuracy (`spin-usd measure`) on the three stages of the figures, and put the files in place.

measure.json goes to tools/figures/measure_NAME.json, the plot to docs/images/measure_NAME.svg. Stages and what was
measured so far stay in --work: run again, it goes on.
"""

import argparse
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import three_stages
from benchmarks.command import asked

ROOT = Path(__file__).resolve().parents[2]
WORK = Path(tempfile.gettempdir()) / "spin_usd-stages"
PASSED_ON = ("count", "seeds", "max_samples", "reference_share", "reference_samples", "workers")


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=Path, default=three_stages.POSES)
    parser.add_argument("--frames", metavar="A:B:STEP", help="of the pose list; all if not given")
    parser.add_argument("--stages", nargs="+", default=list(three_stages.STAGES), choices=three_stages.STAGES)
    parser.add_argument("--work", type=Path, default=WORK)
    parser.add_argument("--figures", type=Path, default=ROOT / "tools" / "figures")
    parser.add_argument("--plots", type=Path, default=ROOT / "docs" / "images")
    for name in PASSED_ON:
        parser.add_argument(f"--{name.replace('_', '-')}", metavar="X", help="as of spin-usd measure")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.stages, options.count, options.seeds, options.max_samples = ["matt"], "1", "2", "1"
        options.reference_samples, options.frames = "16", "3:4"
    return {"stages": {name: of_stage(name, options) for name in options.stages}}


def of_stage(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Measure one; returns how much was measured."""
    stage = three_stages.author(name, options.work / name, poses=options.poses, frames=options.frames)
    given = {option: getattr(options, option) for option in PASSED_ON}
    words = [word for option, value in given.items() if value for word in (f"--{option.replace('_', '-')}", value)]
    folder = stage.parent / "measured"
    found = asked("measure", stage, "--out", folder, *words)
    for file, place in (
        ("measure.json", options.figures / f"measure_{name}.json"),
        ("measure.svg", options.plots / f"measure_{name}.svg"),
    ):
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(folder / file, place)
        os.chmod(place, 0o644)
    return {"frames": len(found["frames"]), "figures": len(found["figures"]), "failures": len(found["failures"])}


def table(figures: dict[str, Any]) -> str:
    lines = ["| stage | pictures | settings on pictures | failures |", "| --- | --- | --- | --- |"]
    for name, found in figures["stages"].items():
        lines.append(f"| {name} | {found['frames']} | {found['figures']} | {found['failures']} |")
    return "\n".join(lines)

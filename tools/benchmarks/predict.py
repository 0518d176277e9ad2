"""What `spin-usd plan` says that a run takes, beside what it takes, on the three stages of the figures.

Each run makes a dataset from nothing by the command line; the stages take turns, round after round. `rest` is what is
not a worker's work on pictures: planning, the start, and workers that have nothing left to do. With --cpus 1 no worker
is beside another: work that takes longer without it says by how much they hinder each other.
"""

import argparse
import statistics
import tempfile
from itertools import product
from pathlib import Path
from typing import Any

import three_stages
from benchmarks.command import asked, run
from benchmarks.spread import shown, spread

from spin_usd.processes.processors import hold_to, usable_cpus

BOUND = 0.25  # of the time, that a prediction may be off


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=Path, default=three_stages.POSES)
    parser.add_argument("--frames", metavar="A:B:STEP", help="of the pose list; all if not given")
    parser.add_argument("--efforts", nargs="+", default=["samples=16"], metavar="TEXT")
    parser.add_argument("--stages", nargs="+", default=list(three_stages.STAGES), choices=three_stages.STAGES)
    parser.add_argument("--renderer", default="blender")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--cpus", type=int, default=len(usable_cpus()), help="processors, and so workers")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.frames, options.efforts, options.stages = "3:4", ["samples=1"], ["matt"]
        options.renderer, options.rounds = "raycast", 1
    hold_to(usable_cpus()[: options.cpus])  # the commands inherit it
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name:
        folder = Path(name)
        roots = {
            stage: three_stages.author(stage, folder / stage, poses=options.poses, frames=options.frames)
            for stage in options.stages
        }
        cases = {case: planned(roots[case[0]], case[1], options) for case in product(roots, options.efforts)}
        for number, (stage, effort) in product(range(options.rounds), cases):
            out = folder / f"dataset {stage} {effort} {number}"
            done = run("render", roots[stage], *asking(effort, options), "--out", out)
            cases[stage, effort]["runs"].append(done.answer)
    return {"rounds": options.rounds, "renderer": options.renderer, "cases": [summed(case) for case in cases.values()]}


def asking(effort: str, options: argparse.Namespace) -> list[str]:
    return ["--effort", effort, "--renderer", options.renderer]


def planned(root: Path, effort: str, options: argparse.Namespace) -> dict[str, Any]:
    """Plan the case; returns it without runs."""
    plan = asked("plan", root, *asking(effort, options))
    names = ("pictures", "workers", "wall_seconds", "core_seconds")
    return {"stage": root.parent.name, "effort": effort, **{name: plan[name] for name in names}, "runs": []}


def summed(case: dict[str, Any]) -> dict[str, Any]:
    """Return the seconds of the runs: of wall clock, and of work over all workers; and what was predicted of them."""
    wall = [run["seconds"] for run in case["runs"]]
    work = [sum(run["work"].values()) for run in case["runs"]]
    kinds = {
        name: statistics.median(run["work"].get(name, 0) for run in case["runs"]) for name in case["runs"][0]["work"]
    }
    workers = min(case["workers"], case["pictures"])
    return {
        **{name: case[name] for name in ("stage", "effort", "pictures", "workers")},
        "predicted_s": round(case["wall_seconds"], 2),
        "taken_s": spread(wall),
        "predicted_over_taken": round(case["wall_seconds"] / statistics.median(wall), 3),
        "predicted_work_s": round(case["core_seconds"], 2),
        "work_s": spread(work),
        "predicted_rest_s": round(case["wall_seconds"] - case["core_seconds"] / workers, 2),
        "rest_s": spread([seconds - each / workers for seconds, each in zip(wall, work, strict=True)]),
        "work": {name: spread([run["work"].get(name, 0.0) for run in case["runs"]]) for name in kinds},
    }


def table(figures: dict[str, Any]) -> str:
    lines = [
        "| stage | effort | pictures | predicted s | taken s | predicted / taken | work, predicted / taken | rest, "
        "predicted and taken s |",
        "| --- " * 8 + "|",
    ]
    for case in figures["cases"]:
        work = case["predicted_work_s"] / case["work_s"]["median"]
        lines.append(
            f"| {case['stage']} | {case['effort']} | {case['pictures']} | {case['predicted_s']:.1f} | "
            f"{shown(case['taken_s'])} | {case['predicted_over_taken']:.2f} | {work:.2f} | "
            f"{case['predicted_rest_s']:.1f}, {case['rest_s']['median']:.1f} |"
        )
    off = [case for case in figures["cases"] if abs(case["predicted_over_taken"] - 1) > BOUND]
    return "\n".join([*lines, f"\noff by more than {BOUND:.0%}: {len(off)} of {len(figures['cases'])}"])

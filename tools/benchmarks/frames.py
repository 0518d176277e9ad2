"""Seconds per picture of spin_usd beside a plain bpy script and what else is installed, picture by picture in turn.

All make the same poses of the same mesh with as many samples and one Sun, one after another, in one run, each held open
in a process of its own. Everything counts until the picture's files are there.
"""

import argparse
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import psutil
from benchmarks.command import asked
from benchmarks.peers import start_all
from benchmarks.spread import shown, spread

from spin_usd import resources
from spin_usd.dataset.process.child import Child
from spin_usd.dataset.process.processors import hold_to, usable_cpus
from spin_usd.dataset.render.request import RenderRequest
from spin_usd.dataset.render.worker_options import WorkerOptions
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import parse_effort
from spin_usd.scene.model import Scene
from spin_usd.stage.read.stage_reader import StageReader

OURS = "spin_usd, image and labels"
LABELS = "spin_usd, labels only (raycast)"


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=Path, default=resources.stages() / "examples" / "tango_speedplus_poses.json")
    parser.add_argument("--target", default="tango")
    parser.add_argument("--units-per-metre", type=float)
    parser.add_argument("--camera", default="speedplus")
    parser.add_argument("--frames", metavar="A:B:STEP", help="of the pose list; all if not given")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--effort", metavar="TEXT", help="of spin_usd alone, as `spin-usd render --effort`")
    parser.add_argument("--rounds", type=int, default=1, help="times that every picture is made")
    parser.add_argument("--cpus", type=int, default=len(usable_cpus()), help="processors that each may use")
    parser.add_argument("--mitsuba-python", default=sys.executable, help="a Python that has Mitsuba")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """Author the stage, then make every picture with each in turn."""
    if options.quick:
        options.frames, options.samples, options.rounds = "0:2", 1, 1
    hold_to(usable_cpus()[: options.cpus])  # all others inherit it
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name, ExitStack() as stack:
        folder = Path(name)
        stage = author(options, folder / "stage")
        reader = StageReader(stage)
        scenes = [reader.scene(frame) for frame in reader.frames]
        makers, versions, left_out = start(options, stage, scenes[0], folder, stack)
        for make, pid in makers.values():
            timed(partial(make, scenes[0]), pid)  # warms it up, and does not count
        taken: dict[str, list[dict[str, float]]] = {name: [] for name in makers}
        for _ in range(options.rounds):
            for scene in scenes:
                for name, (make, pid) in makers.items():
                    taken[name].append(timed(partial(make, scene), pid))
    return {
        "pictures": len(scenes),
        "rounds": options.rounds,
        "samples": options.samples,
        "faces": len(scenes[0].target.mesh.faces),
        "frame": [scenes[0].camera.width, scenes[0].camera.height],
        "box_share": spread([region_share(scene) for scene in scenes]),
        "versions": versions,
        "left_out": left_out,
        "makers": {name: summed(runs, taken[OURS]) for name, runs in taken.items()},
        "seconds": {name: [run["wall_s"] for run in runs] for name, runs in taken.items()},
    }


Make = Callable[[Any], None]


def start(
    options: argparse.Namespace, stage: Path, first: Any, folder: Path, stack: ExitStack
) -> tuple[dict[str, tuple[Make, int]], dict[str, str], dict[str, str]]:
    """By name what makes a scene's picture and in which process; the others' versions; why some are left out."""
    effort = parse_effort(options.effort or f"samples={options.samples}")
    makers = {}
    for name, renderer in ((OURS, "blender"), (LABELS, "raycast")):
        settings = RenderSettings(renderer=renderer, effort=effort, seed=0)
        kinds = RenderRequest(stage=stage, effort=effort, image=renderer == "blender").kinds
        makers[name] = _ours(stage, folder / renderer, settings, kinds, stack)
    peers, left_out = start_all(first, folder, options.samples, options.mitsuba_python)
    for peer in peers:
        stack.callback(peer.close)
        makers[peer.name] = peer.picture, peer.pid
    return makers, {peer.name: peer.version for peer in peers}, left_out


def _ours(
    stage: Path, root: Path, settings: RenderSettings, kinds: tuple[str, ...], stack: ExitStack
) -> tuple[Make, int]:
    options = WorkerOptions(
        root=str(root), work=str(root / "work"), stage=str(stage), image_suffix=".png", settings=settings
    )
    child = stack.enter_context(Child())
    child.call("open_worker", options=options.as_json())

    def make(scene: Any) -> None:
        shutil.rmtree(root / "cache", ignore_errors=True)  # of this picture, made before
        child.call("picture", variant="nominal", index=scene.frame.index, kinds=kinds)

    return make, child.process.pid


def author(options: argparse.Namespace, out: Path) -> Path:
    model = ["--poses", options.poses, "--target", options.target, "--camera", options.camera]
    units = ["--units-per-metre", options.units_per_metre] if options.units_per_metre else []
    chosen = ["--frames", options.frames] if options.frames else []
    return Path(asked("author", *model, *units, *chosen, "--out", out)["root"])


def timed(make: Callable[[], None], pid: int) -> dict[str, float]:
    """Seconds of wall clock, and of processor in the process that makes it."""
    process = psutil.Process(pid)
    before, began = process.cpu_times(), time.perf_counter()
    make()
    wall, after = time.perf_counter() - began, process.cpu_times()
    return {"wall_s": round(wall, 4), "cpu_s": round(after.user + after.system - before.user - before.system, 2)}


def region_share(scene: Scene) -> float:
    """The share of the frame that the box around the target takes."""
    frame = scene.camera.frame
    return scene.picture_region.width * scene.picture_region.height / (frame.width * frame.height)


def summed(runs: list[dict[str, float]], ours: list[dict[str, float]]) -> dict[str, Any]:
    """Spreads over the pictures, and over ours, picture by picture and in total."""
    ratios = [run["wall_s"] / own["wall_s"] for run, own in zip(runs, ours, strict=True)]
    totals = [sum(run["wall_s"] for run in each) for each in (runs, ours)]
    return {
        "wall_s": spread([run["wall_s"] for run in runs]),
        "mean_wall_s": round(statistics.fmean(run["wall_s"] for run in runs), 4),
        "cpu_s": spread([run["cpu_s"] for run in runs]),
        "over_ours": spread(ratios),
        "total_over_ours": round(totals[0] / totals[1], 3),
    }


def table(figures: dict[str, Any]) -> str:
    """The figures as Markdown: median (least to most)."""
    lines = [
        "| seconds per picture | wall clock | processor | over spin_usd, picture by picture | in total |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, found in figures["makers"].items():
        ratio = shown(found["over_ours"]), f"{found['total_over_ours']:.2f}"
        lines.append(f"| {name} | {shown(found['wall_s'])} | {shown(found['cpu_s'])} | {' | '.join(ratio)} |")
    lines += [f"\nleft out: {name}, {reason}" for name, reason in figures["left_out"].items()]
    return "\n".join(lines)

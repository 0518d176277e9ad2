"""Seconds per picture of spin_usd beside a plain bpy script and what else is installed, picture by picture in turn.

All make the same poses of the same mesh, one after another, in one run, each held open in a process of its own; the
others with as many samples as spin_usd's first line. Everything counts until the picture's files are there.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import psutil
import three_stages
from benchmarks.own_worker import OwnWorker
from benchmarks.peers import start_all
from benchmarks.spread import shown, spread

from spin_usd.processes.processors import hold_to, usable_cpus
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import DEFAULT_QUALITY, QUALITIES, Effort
from spin_usd.scene.scene import Scene
from spin_usd.stage.read.stage_reader import StageReader

WIDTH, HEIGHT, FOCAL = 1920, 1200, 2988.5795163815555  # of SPEED+'s camera
EQUAL = "spin_usd, as many plain samples"
DEFAULT = f"spin_usd, default (`--quality {DEFAULT_QUALITY}`)"
DRAFT = "spin_usd, `--quality draft`"
LABELS = "spin_usd, labels only"
CROPPED_SCRIPT = "plain bpy script, cropped to the target's box"


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=Path, default=three_stages.POSES)
    parser.add_argument("--stage", default="matt", choices=three_stages.STAGES)
    parser.add_argument("--frames", metavar="A:B:STEP", help="of the pose list; all if not given")
    parser.add_argument(
        "--width", type=int, metavar="PIXELS", help="of a lens without distortion; SPEED+'s if not given"
    )
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--rounds", type=int, default=1, help="times that every picture is made")
    parser.add_argument("--cpus", type=int, default=len(usable_cpus()), help="processors that each may use")
    parser.add_argument("--mitsuba-python", default=sys.executable, help="a Python that has Mitsuba")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """Author the stage, then make every picture with each in turn."""
    if options.quick:
        options.frames, options.samples, options.rounds, options.width = "0:2", 1, 1, WIDTH // 4
    hold_to(usable_cpus()[: options.cpus])  # all others inherit it
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name, ExitStack() as stack:
        folder = Path(name)
        camera = own_camera(folder / "camera.json", options.width) if options.width else "speedplus"
        stage = three_stages.author(
            options.stage, folder / "stage", poses=options.poses, frames=options.frames, camera=camera
        )
        reader = StageReader(stage)
        scenes = [reader.scene(frame) for frame in reader.frames]
        makers, versions, left_out = start(options, stage, scenes[0], folder, stack)
        taken = in_turn(makers, scenes, options.rounds)
    return {
        "stage": options.stage,
        "pictures": len(scenes),
        "rounds": options.rounds,
        "samples": options.samples,
        "faces": len(scenes[0].bodies[0].target.mesh.faces),
        "frame": [scenes[0].camera.width, scenes[0].camera.height],
        "box_share": spread([region_share(scene) for scene in scenes]),
        "versions": versions,
        "left_out": left_out,
        "makers": {name: summed(runs, taken[CROPPED_SCRIPT]) for name, runs in taken.items()},
        "cpu_s": {name: [run["cpu_s"] for run in runs] for name, runs in taken.items()},
    }


def own_camera(file: Path, width: int) -> str:
    """Write SPEED+'s lens without its distortion, on an image of that width; return the file's path."""
    scale = width / WIDTH
    height, focal = round(HEIGHT * scale), FOCAL * scale
    matrix = [[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]]
    camera = {"Nu": width, "Nv": height, "cameraMatrix": matrix, "distCoeffs": [0, 0, 0, 0, 0]}
    file.write_text(json.dumps(camera))
    return str(file)


Make = Callable[..., None]


def start(
    options: argparse.Namespace, stage: Path, first: Any, folder: Path, stack: ExitStack
) -> tuple[dict[str, tuple[Make, int]], dict[str, str], dict[str, str]]:
    """Return by name what makes a scene's picture and in which process; the others' versions; why some are left
    out."""
    makers = {}
    for number, (name, effort) in enumerate(_efforts(options.samples).items()):
        settings = RenderSettings(renderer="blender", effort=effort, seed=0)
        own = OwnWorker(stage, folder / f"own{number}", settings, stack, image=name != LABELS)
        makers[name] = own.picture, own.pid
    peers, left_out = start_all(first, folder, options.samples, options.mitsuba_python)
    for peer in peers:
        stack.callback(peer.close)
        makers[peer.name] = peer.picture, peer.pid
    return makers, {peer.name: peer.version for peer in peers}, left_out


def in_turn(makers: dict[str, tuple[Make, int]], scenes: list[Scene], rounds: int) -> dict[str, list[dict[str, float]]]:
    """Make every picture with each maker in turn, again in every round; return what each took for each, by name."""
    for make, pid in makers.values():
        timed(partial(make, scenes[0]), pid)  # warms it up, and does not count
    taken: dict[str, list[dict[str, float]]] = {name: [] for name in makers}
    for _, scene in product(range(rounds), scenes):
        for name, (make, pid) in makers.items():
            taken[name].append(timed(partial(make, scene), pid))
    return taken


def _efforts(samples: int) -> dict[str, Effort]:
    """Return spin_usd's efforts by name."""
    plain = Effort(samples=samples)
    return {EQUAL: plain, DEFAULT: QUALITIES[DEFAULT_QUALITY], DRAFT: QUALITIES["draft"], LABELS: plain}


def timed(make: Callable[[], None], pid: int) -> dict[str, float]:
    """Return seconds of wall clock, and of processor in the process that makes it."""
    process = psutil.Process(pid)
    before, began = process.cpu_times(), time.perf_counter()
    make()
    wall, after = time.perf_counter() - began, process.cpu_times()
    return {"wall_s": round(wall, 4), "cpu_s": round(after.user + after.system - before.user - before.system, 2)}


def region_share(scene: Scene) -> float:
    """Return the share of the frame that the box around the target takes."""
    frame = scene.camera.frame
    return scene.picture_region.width * scene.picture_region.height / (frame.width * frame.height)


def summed(runs: list[dict[str, float]], script: list[dict[str, float]]) -> dict[str, Any]:
    """Return spreads over the pictures, and processor time over that of the cropped script, picture by picture and in
    total."""
    ratios = [run["cpu_s"] / other["cpu_s"] for run, other in zip(runs, script, strict=True)]
    totals = [sum(run["cpu_s"] for run in each) for each in (runs, script)]
    return {
        "wall_s": spread([run["wall_s"] for run in runs]),
        "mean_wall_s": round(statistics.fmean(run["wall_s"] for run in runs), 4),
        "cpu_s": spread([run["cpu_s"] for run in runs]),
        "cpu_over_script": spread(ratios),
        "total_cpu_over_script": round(totals[0] / totals[1], 3),
    }


def table(figures: dict[str, Any]) -> str:
    """Return the figures as Markdown: median (least to most)."""
    lines = [
        "| seconds per picture | wall clock | processor | processor, over the cropped script | in total |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, found in figures["makers"].items():
        ratio = shown(found["cpu_over_script"]), f"{found['total_cpu_over_script']:.2f}"
        lines.append(f"| {name} | {shown(found['wall_s'])} | {shown(found['cpu_s'])} | {' | '.join(ratio)} |")
    lines += [f"\nleft out: {name}, {reason}" for name, reason in figures["left_out"].items()]
    return "\n".join(lines)

"""Processor seconds of a picture at equal error: spin_usd beside Mitsuba llvm, cropped to the target's box.

Each is compared with a reference of its own, of many samples, so that it does not count that they shade differently.
The error is that of docs/concepts/accuracy.md: relative, in linear light, root mean square over the target's pixels. A
path tracer takes a + b / error^2 seconds; with a and b fitted to Mitsuba's rows they say what it takes to reach each of
spin_usd's errors.
"""

import argparse
import statistics
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import three_stages
from benchmarks.frames import timed
from benchmarks.own_worker import OwnWorker
from benchmarks.peers import Peer, start_mitsuba
from numpy.typing import NDArray
from scipy.optimize import nnls

from spin_usd.accuracy.error import Reference
from spin_usd.processes.processors import hold_to, usable_cpus
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import DEFAULT_QUALITY, QUALITIES, Effort
from spin_usd.scene.scene import Scene
from spin_usd.stage.read.stage_reader import StageReader

EFFORTS = {
    **{f"`--quality {name}`": QUALITIES[name] for name in ("preview", "draft", DEFAULT_QUALITY)},
    "16 plain samples": Effort(samples=16),
}
PARTS = 2  # of a reference: their difference says how far off it is
HALF = 0.5  # a pixel is the target's where that covers as much of it
Light = NDArray[np.float32]
"""(rows, columns, 4) of the target's box: linear red, green and blue, and the share of each pixel that it covers."""
Row = dict[str, Any]


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=Path, default=three_stages.POSES)
    parser.add_argument("--frames", default="1:2", metavar="A:B:STEP", help="of the pose list; the first is made")
    parser.add_argument("--stages", nargs="+", default=list(three_stages.STAGES), choices=three_stages.STAGES)
    parser.add_argument("--samples", nargs="+", type=int, default=[4, 16, 64, 256], help="of Mitsuba")
    parser.add_argument("--reference-samples", type=int, default=512, help=f"of each of {PARTS} parts, of both")
    parser.add_argument("--rounds", type=int, default=3, help="times that every picture is made")
    parser.add_argument("--mitsuba-python", default=sys.executable, help="a Python that has Mitsuba")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.stages, options.samples, options.reference_samples, options.rounds = ["matt"], [1, 2], 4, 1
    hold_to(usable_cpus())
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as folder:
        stages = {name: of_stage(name, options, Path(folder) / name) for name in options.stages}
    return {"reference_samples": PARTS * options.reference_samples, "rounds": options.rounds, "stages": stages}


def of_stage(name: str, options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Return the rows of both and how far off their references are; where Mitsuba does not work, only spin_usd's, and
    why."""
    stage = three_stages.author(name, folder / "stage", poses=options.poses, frames=options.frames)
    reader = StageReader(stage)
    scene = reader.scene(reader.frames[0])
    rows, off = ours(stage, scene, folder, options)
    try:
        peer = start_mitsuba(scene, folder, options.mitsuba_python)
    except OSError as error:
        return {"rows": rows, "references": {"spin_usd": off}, "left_out": str(error)}
    peer_rows, peer_off = mitsuba(peer, scene, options)
    peer.close()
    fitted = cost_of_error(peer_rows)
    for row in rows:
        row["mitsuba_cpu_s"] = round(fitted(row["error"]), 3)
    return {"rows": [*rows, *peer_rows], "references": {"spin_usd": off, "Mitsuba": peer_off}}


def ours(stage: Path, scene: Scene, folder: Path, options: argparse.Namespace) -> tuple[list[Row], float]:
    """Return a row for each of EFFORTS and how far off the reference is. The seconds are those of whole pictures with
    labels and files."""
    reference = [
        made(stage, scene, folder / f"part{seed}", Effort(samples=options.reference_samples), seed, rounds=0)[1]
        for seed in range(1, PARTS + 1)
    ]
    rows = []
    for number, (words, effort) in enumerate(EFFORTS.items()):
        seconds, light = made(stage, scene, folder / f"own{number}", effort, 0, rounds=options.rounds)
        error, off = error_of(light, reference)
        rows.append({"tool": "spin_usd", "what": words, "samples": effort.samples, "cpu_s": seconds, "error": error})
    return rows, off


def made(stage: Path, scene: Scene, root: Path, effort: Effort, seed: int, *, rounds: int) -> tuple[float, Light]:
    """Make the picture once, then in `rounds`; return its median processor seconds over those, and its light."""
    with ExitStack() as stack:
        settings = RenderSettings(renderer="blender", effort=effort, seed=seed)
        worker = OwnWorker(stage, root, settings, stack)
        worker.picture(scene)
        return median_seconds(partial(worker.picture, scene), worker.pid, rounds), worker.radiance(scene)


def mitsuba(peer: Peer, scene: Scene, options: argparse.Namespace) -> tuple[list[Row], float]:
    """Return a row for each number of samples, and how far off the reference is."""
    reference = [light_of(peer, scene, options.reference_samples, seed) for seed in range(1, PARTS + 1)]
    rows = []
    for samples in options.samples:
        light = light_of(peer, scene, samples, 0)
        seconds = median_seconds(partial(peer.picture, scene, samples, 0), peer.pid, options.rounds)
        error, off = error_of(light, reference)
        what = f"{samples} samples"
        rows.append({"tool": "Mitsuba", "what": what, "samples": samples, "cpu_s": seconds, "error": error})
    return rows, off


def light_of(peer: Peer, scene: Scene, samples: int, seed: int) -> Light:
    """Make the picture by the peer and read its light."""
    peer.picture(scene, samples, seed)
    latest = max(peer.log.parent.glob("*.exr"))
    return np.asarray(OpenImageIO.ImageBuf(str(latest)).get_pixels(OpenImageIO.FLOAT))[..., :4]


def median_seconds(make: Callable[[], None], pid: int, rounds: int) -> float:
    """Return the median processor seconds of the process `pid` over the rounds, each with a picture of its own; 0
    for none."""
    return round(statistics.median([timed(make, pid)["cpu_s"] for _ in range(rounds)] or [0.0]), 3)


def error_of(light: Light, parts: Sequence[Light]) -> tuple[float, float]:
    """Return the relative error of `light`, from which the reference's own is taken, and the reference's own."""
    target = np.mean([part[..., 3] for part in parts], axis=0) >= HALF
    reference = Reference.of([part[target][:, :3] for part in parts])
    apart = reference.relative(light[target][:, :3] - reference.radiance)
    own = reference.error_squared
    return round(float(np.sqrt(max(apart - own, 0.0))), 5), round(float(np.sqrt(own)), 5)


def cost_of_error(rows: Sequence[Row]) -> Callable[[float], float]:
    """Return seconds as a function of the error: a + b / error^2 with a and b of 0 or more, fitted to the rows by least
    squares of relative deviations."""
    errors, seconds = (np.array([max(row[name], 1e-6) for row in rows]) for name in ("error", "cpu_s"))
    a, b = nnls(np.stack([np.ones_like(errors), errors**-2.0], 1) / seconds[:, None], np.ones_like(seconds))[0]
    return lambda error: float(a + b / max(error, 1e-6) ** 2)


def table(figures: dict[str, Any]) -> str:
    lines = ["| stage | tool | what | CPU s | error | Mitsuba's CPU s at that error |", "| --- | --- " * 3 + "|"]
    for stage, found in figures["stages"].items():
        for row in found["rows"]:
            beside = f"{row['mitsuba_cpu_s']:.3g}" if "mitsuba_cpu_s" in row else ""
            lines.append(f"| {stage} | {row['tool']} | {row['what']} | {row['cpu_s']} | {row['error']} | {beside} |")
        lines.append(f"| {stage} | references | off by | {found['references']} | | |")
    return "\n".join(lines)

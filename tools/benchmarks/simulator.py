"""Milliseconds of a picture from a Simulator and a FreshDataset that are kept open, beside the same through files, and
a plain bpy script that is kept open and has the same samples.

Each picture has a pose that was not shown before; both share the same processors, one if not said otherwise.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import three_stages
from benchmarks.command import run
from benchmarks.frames import own_camera
from benchmarks.peers import start_bpy, write_scene

from spin_usd import Dataset, FreshDataset, Simulator
from spin_usd.geometry.transform import Transform
from spin_usd.processes.processors import hold_to, usable_cpus
from spin_usd.scene.effort import QUALITIES
from spin_usd.stage.read.stage_reader import StageReader

WAYS: dict[str, dict[str, Any]] = {
    "depth, parts, dense pose": {"image": False, "labels": "default", "renderer": "raycast", "samples": 1},
    "raycast": {"renderer": "raycast", "samples": 1},
    "Blender, `preview`": {"quality": "preview"},
    "Blender, `draft`": {"quality": "draft"},
}
PLAIN = ("preview", "draft")  # qualities whose samples the plain script has
WARM = 5  # pictures before those that count
SPEC = """schema = "augment-1"
[[augmentation]]
name = "fresh"
[augmentation.sample]
"sun.factor" = { distribution = "log_uniform", low = 0.3, high = 3 }
"exposure.stops" = { distribution = "uniform", low = -1, high = 1, unit = "stops" }
"optics.psf_sigma" = { distribution = "uniform", low = 0.3, high = 1, unit = "px" }
"optics.glare" = { distribution = "uniform", low = 0, high = 0.05 }
"sensor.read_noise" = { distribution = "uniform", low = 2, high = 12, unit = "electrons" }
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--widths", type=int, nargs="+", default=[128, 256, 512], metavar="PIXELS")
    parser.add_argument("--pictures", type=int, default=200, help="of each way and width")
    parser.add_argument("--cpus", type=int, default=1, help="processors, and workers, that each may use")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """Author a stage of each width, and make pictures of it in each way."""
    if options.quick:
        options.widths, options.pictures = [64], 10
    hold_to(usable_cpus()[: options.cpus])  # all others inherit it
    rows = []
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name:
        for width in options.widths:
            folder = Path(name, str(width))
            folder.mkdir()
            camera = own_camera(folder / "camera.json", width)
            stage = three_stages.author("matt", folder / "stage", frames="0:8", camera=camera)
            rows += [row(width, way, *simulated(stage, how, options)) for way, how in WAYS.items()]
            rows += [
                row(width, f"plain bpy script, samples of `{q}`", *plain(stage, folder, q, options)) for q in PLAIN
            ]
            rows += fresh(width, stage, folder, options)
    return {"pictures": options.pictures, "cpus": options.cpus, "rows": rows}


def row(width: int, way: str, first: float, taken: list[float], files: float | None = None) -> dict[str, Any]:
    """Return a row: milliseconds of the first picture with what opens it, of the others, and of those through files."""
    median, most = np.percentile(taken, (50, 99)).tolist()
    rate = 1000 / float(np.mean(taken))
    return {"width": width, "way": way, "first": first, "median": median, "p99": most, "rate": rate, "files": files}


def simulated(stage: Path, how: dict[str, Any], options: argparse.Namespace) -> tuple[float, list[float], float]:
    began = time.perf_counter()
    with Simulator(stage, workers=options.cpus, **how) as simulator:
        start = simulator.picture(0).T_cam_body
        first = 1000 * (time.perf_counter() - began)
        taken = list(timed(simulator.pictures({"pose": pose} for pose in poses(start, options.pictures + WARM))))
    names = {"image": "labels_only", "labels": "labels"}
    given = {names.get(key, key): value for key, value in how.items() if key != "image"}
    words = [word for key, value in given.items() for word in (f"--{key}", str(value))]
    words += ["--labels-only"] if how.get("image") is False else ["--labels", "none"]
    if how.get("image") is False:
        words = [word for word in words if word not in ("--renderer", "raycast", "--samples", "1")]
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as out:
        done = run("render", stage, "--out", Path(out, "dataset"), "--workers", options.cpus, *words)
    return first, taken[WARM:], 1000 * done.wall_s / done.answer["made"]


def plain(stage: Path, folder: Path, quality: str, options: argparse.Namespace) -> tuple[float, list[float]]:
    """Return the milliseconds of a plain bpy script: the whole frame in an EXR of all passes, and a PNG."""
    reader = StageReader(stage)
    scene = reader.scene(reader.frames[0])
    own = folder / quality
    own.mkdir()
    write_scene(scene, own / "scene.npz")
    began, taken = time.perf_counter(), []
    peer = start_bpy(own, QUALITIES[quality].samples)
    for pose in poses(scene.bodies[0].T_cam_body.matrix, options.pictures + WARM + 1):
        placed = Transform(to="cam", of="body", rotation=pose[:3, :3], translation=pose[:3, 3])
        peer.picture(replace(scene, bodies=(replace(scene.bodies[0], T_cam_body=placed),)))
        taken.append(1000 * (time.perf_counter() - began))
        began = time.perf_counter()
    peer.close()
    return taken[0], taken[1 + WARM :]


def poses(start: np.ndarray, count: int) -> Iterator[np.ndarray]:
    """Yield poses that turn about the target's own axis and come nearer."""
    for step in range(count):
        angle = 0.01 * step
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        pose = start @ turn
        pose[2, 3] *= 1 - 0.2 * step / count
        yield pose


def timed(pictures: Iterator[Any], use: Callable[[Any], object] = lambda _: None) -> Iterator[float]:
    """Yield the milliseconds from one picture to the next."""
    before = time.perf_counter()
    for picture in pictures:
        use(picture)
        now = time.perf_counter()
        yield 1000 * (now - before)
        before = now


def fresh(width: int, stage: Path, folder: Path, options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Yield rows of images developed anew, and of the stored ones read again."""
    spec = folder / "fresh.toml"
    spec.write_text(SPEC)
    run("render", stage, "--out", folder / "dataset", "--quality", "draft", "--labels", "none")
    dataset = FreshDataset(folder / "dataset", spec)
    for way, part, stored in (
        ("developed anew", dataset, Dataset(dataset.root)),
        ("developed anew, a crop of 128", dataset.crop(size=128), Dataset(dataset.root).crop(size=128)),
    ):
        began = time.perf_counter()
        assert part[0].image.any()
        first = 1000 * (time.perf_counter() - began)
        taken = list(timed(of_epochs(part, options.pictures + WARM), lambda picture: picture.image))[WARM:]
        again = (stored[i % len(stored)] for i in range(options.pictures))
        files = float(np.mean(list(timed(again, lambda picture: picture.image))))
        yield row(width, way, first, taken, files)


def of_epochs(dataset: FreshDataset, count: int) -> Iterator[Any]:
    for number in range(count):
        dataset.set_epoch(number // len(dataset))
        yield dataset[number % len(dataset)]


def table(figures: dict[str, Any]) -> str:
    """Return the figures as a table for people."""
    lines = [
        f"{figures['pictures']} pictures each, {figures['cpus']} cores; milliseconds",
        "",
        "| width | way | first | median | 99 % | a second | through files |",
        "| ---: | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for each in figures["rows"]:
        named = (each[name] for name in ("first", "median", "p99", "rate", "files"))
        numbers = " | ".join("" if value is None else f"{value:.3g}" for value in named)
        lines.append(f"| {each['width']} | {each['way']} | {numbers} |")
    return "\n".join(lines)

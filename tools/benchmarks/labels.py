"""What each label costs on one core: the pass that finds the faces, the points on them, then label by label.

Tango through the SPEED+ camera at 1920 x 1200, without Blender. No file is written, which takes as long whatever is in
it; keypoint heatmaps, which have no file, are made of a picture that is.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.command import asked
from benchmarks.spread import shown, spread

import spin_usd
from spin_usd.basics import resources
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.processes.processors import hold_to, usable_cpus
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.surface import Surface, visible_surface
from spin_usd.scene.scene import Scene
from spin_usd.stage.read.stage_reader import StageReader

PASS, POINTS, HEATMAPS = "faces seen", "points on them", "heatmaps, 192x128"


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=Path, default=resources.stages() / "examples" / "tango_speedplus_poses.json")
    parser.add_argument("--target", default="tango")
    parser.add_argument("--camera", default="speedplus")
    parser.add_argument("--frames", metavar="A:B:STEP", help="of the pose list; all if not given")
    parser.add_argument("--rounds", type=int, default=5, help="times that every label is made; the median counts")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """Author the stage, and make every label of every frame."""
    if options.quick:
        options.frames, options.rounds = "0:2", 1
    hold_to(usable_cpus()[:1])
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name:
        stage = author(options, Path(name) / "stage")
        dataset = Path(name) / "dataset"
        asked("render", stage, "--out", dataset, "--renderer", "raycast", "--labels", "depth", "--labels-only")
        reader, caster = StageReader(stage), EmbreeCaster()
        scenes = [reader.scene(frame, views={"next_frame"}) for frame in reader.frames]
        caster.visibility(scenes[0])  # builds what all share
        taken = [
            {**of_labels(scene, caster, options.rounds), HEATMAPS: seconds(picture.heatmaps, options.rounds)}
            for scene, picture in zip(scenes, spin_usd.Dataset(dataset), strict=True)
        ]
        camera = scenes[0].camera
        shares = [visible(scene, caster).z.size / (camera.width * camera.height) for scene in scenes]
    return {
        "frame": [camera.width, camera.height],
        "pictures": len(scenes),
        "rounds": options.rounds,
        "target_share": spread(shares),
        "seconds": {kind: spread([of[kind] for of in taken]) for kind in taken[0]},
        "in_all": spread([sum(of.values()) for of in taken]),
    }


def author(options: argparse.Namespace, out: Path) -> Path:
    model = ["--poses", options.poses, "--target", options.target, "--camera", options.camera]
    chosen = ["--frames", options.frames] if options.frames else []
    return Path(asked("author", *model, *chosen, "--out", out)["root"])


def of_labels(scene: Scene, caster: EmbreeCaster, rounds: int) -> dict[str, float]:
    """Return seconds by kind of work. What labels share, such as normals, counts for the first that takes it."""
    visibility = caster.visibility(scene)
    found = {
        PASS: seconds(partial(caster.visibility, scene), rounds),
        POINTS: seconds(partial(visible_surface, scene, visibility, caster), rounds),
    }
    runs: dict[str, list[float]] = {name: [] for name in PIXEL_LABELS}
    for _ in range(rounds):
        surface = visible_surface(scene, visibility, caster)
        for name, label in PIXEL_LABELS.items():
            runs[name].append(seconds(partial(label.make, scene, surface), 1))
    return found | {name: statistics.median(each) for name, each in runs.items()}


def visible(scene: Scene, caster: EmbreeCaster) -> Surface:
    return visible_surface(scene, caster.visibility(scene), caster)


def seconds(work: Callable[[], object], rounds: int) -> float:
    """Return the median of the processor's seconds."""
    taken = []
    for _ in range(rounds):
        began = time.process_time()
        work()
        taken.append(time.process_time() - began)
    return statistics.median(taken)


def table(figures: dict[str, Any]) -> str:
    """Return seconds of one core: median of the pictures (least to most)."""
    head = f"| seconds; Tango covers {shown(figures['target_share'])} of {figures['pictures']} pictures |  |"
    lines = [head, "| --- | ---: |"]
    lines += [f"| {kind} | {shown(found)} |" for kind, found in figures["seconds"].items()]
    return "\n".join([*lines, f"| in all | {shown(figures['in_all'])} |"])

"""How noisy glints are with each setting that could end them, and how far it is off for that: on a part of `sunlamp`.

That part is full of light of the Sun that comes to the camera by way of two shiny surfaces. Each effort is rendered
with several seeds and held against a reference, by the formulas of `spin-usd measure` (spin_usd.accuracy.error).
"""

import argparse
import math
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import three_stages
from numpy.typing import NDArray

from spin_usd.accuracy.error import LinearError, Reference, linear_error
from spin_usd.commands.measure.picture_task import REFERENCE_BOUNCES
from spin_usd.geometry.region import Region
from spin_usd.renderers.blender.renderer import BlenderRenderer
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import DEFAULT_QUALITY, QUALITIES, Effort
from spin_usd.scene.model import Scene
from spin_usd.stage.read.stage_reader import StageReader

FRAME = "3:4"
PART = Region(x0=987, y0=468, x1=1083, y1=532)
HALF = 0.5  # a pixel is the target's where that covers as much of it
PLAIN = Effort(samples=16)
DENOISED = replace(QUALITIES[DEFAULT_QUALITY], filter_glossy=0.0)
FINE = replace(QUALITIES["reference"], filter_glossy=0.0)
FILTERS = (0.1, 0.2, 0.3)
CLAMPS = (3.0, 1.0, 0.3)
LEAST_SEEDS = 3
REFERENCE_SEEDS = 1000  # from here on, apart from those of the efforts
Render = NDArray[np.float32]
"""(pixels, 4): linear red, green and blue of the part, and the share of each pixel that the target covers."""
SHARES = ("error", "noise", "bias", "light")
Pixels = NDArray[np.bool_]
Row = dict[str, Any]


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--parts", type=int, default=16, help="of the reference")
    parser.add_argument("--part-samples", type=int, default=512, help="of each part")
    parser.add_argument("--samples", type=int, default=512, help="of all seeds of an effort together")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.parts, options.part_samples, options.samples = 2, 1, 2
    chosen = [PLAIN] if options.quick else efforts()
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as folder:
        stage = three_stages.author("sunlamp", Path(folder) / "stage", frames=FRAME)
        reader = StageReader(stage)
        scene = only(PART, reader.scene(reader.frames[0]))
        render = partial(rendered, BlenderRenderer(), scene)
        converged = Effort(samples=options.part_samples, bounces=REFERENCE_BOUNCES)
        parts = [render(converged, REFERENCE_SEEDS + number) for number in range(options.parts)]
        target = np.mean([part[:, 3] for part in parts], axis=0) >= HALF
        reference = Reference.of(part[target, :3] for part in parts)
        return {
            "pixels": int(target.sum()),
            "reference_samples": options.parts * options.part_samples,
            "reference_error": round(math.sqrt(reference.error_squared), 4),
            "rows": [row(render, target, reference, effort, options.samples) for effort in chosen],
        }


def efforts() -> Iterator[Effort]:
    """Yield few samples, plain and denoised, and many, each with the filter, and what else could end glints."""
    for effort in (PLAIN, DENOISED, FINE):
        yield effort
        yield from (replace(effort, filter_glossy=each) for each in FILTERS)
        if effort != FINE:
            yield from (replace(effort, clamp=each) for each in CLAMPS)
    yield from (replace(PLAIN, samples=64), replace(PLAIN, bounces=0))


def only(part: Region, scene: Scene) -> Scene:
    """Return the scene as a camera sees it whose frame is that part: the same rays through the same lens."""
    camera = scene.camera
    cx, cy = camera.cx - part.x0, camera.cy - part.y0
    return replace(scene, camera=replace(camera, width=part.width, height=part.height, cx=cx, cy=cy))


def rendered(renderer: BlenderRenderer, scene: Scene, effort: Effort, seed: int) -> Render:
    """Render the scene in its own light."""
    light = in_unit_light(scene)
    made = renderer.radiance(light.scene, effort, seed=seed).relit(light.gains)
    assert made.region == scene.camera.frame, "the target does not fill the part"
    return made.rgba.reshape(-1, 4)


def row(
    render: Callable[[Effort, int], Render], target: Pixels, reference: Reference, effort: Effort, samples: int
) -> Row:
    """Return the figures of an effort, by as many seeds as take so many samples, but LEAST_SEEDS at least."""
    seeds = range(max(samples // effort.samples, LEAST_SEEDS))
    found = linear_error(np.stack([render(effort, seed)[target, :3] for seed in seeds]), reference)
    return {"effort": effort.text, "seeds": len(seeds), **figures(found)}


def figures(found: LinearError) -> dict[str, float]:
    """Return shares: of the error what is noise and what is bias, and how much light is missing, below 0, or added."""
    squares = {"error": found.squared, "noise": found.variance, "bias": max(found.bias_squared, 0.0)}
    return {**{name: round(math.sqrt(of), 4) for name, of in squares.items()}, "light": round(found.brightness, 4)}


def table(figures: dict[str, Any]) -> str:
    lines = [f"| effort | {' | '.join(SHARES)} |", f"|{' --- |' * (1 + len(SHARES))}"]
    for row in figures["rows"]:
        shares = " | ".join(f"{row[name]:.1%}" for name in SHARES)
        lines.append(f"| {row['effort']} | {shares} |")
    return "\n".join(lines)

"""Where the processor time of a picture by Blender goes: per sample, fixed parts, denoiser, and what is not Cycles.

One worker, as a run has it, makes the same pictures in one process at efforts that differ in one thing, one effort
after another, each after a picture that does not count; the parts are differences of the medians. The stages are
`sunlamp` and `earth` of three_stages, and `obj`, the Tango mesh of 23,360 faces in --data under the preset
spin_sunlamp, which is left out where that folder has none.
"""

import argparse
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import three_stages
from benchmarks.calibrate import quiet
from benchmarks.command import asked
from benchmarks.frames import own_camera
from benchmarks.growth import POSES
from msgspec import to_builtins

from spin_usd.accuracy.tables import in_markdown
from spin_usd.commands.render.worker_options import WorkerOptions
from spin_usd.options import PictureOptions
from spin_usd.planning.request import RenderRequest
from spin_usd.renderers.crop import picture_bands
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.model import Scene

MESH = Path("tango", "tango.obj")
STAGES = ("sunlamp", "obj", "earth")
FEW, MORE, MANY = (Effort(samples=samples) for samples in (1, 4, 16))
PARTS = {
    "sample": "a sample",
    "fixed": "fixed, in all",
    "scene": "that the pose is another than before",
    "bands": "finding the bands",
    "call": "the rest: Blender's call",
    "groups": "light groups",
    "fast": "denoiser fast, with its guides",
    "balanced": "denoiser balanced, with its guides",
    "adaptive": "adaptive sampling that stops nothing",
    "afresh": "without persistent data",
    "own": "labels, background, detector, files",
}
"""Parts of a picture's processor time, and what the table calls them. `scene`, `bands` and `call` are all of `fixed`;
`groups`, `fast`, `balanced`, `adaptive` and `afresh` are what a picture takes more with them than without."""


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--stages", nargs="+", choices=STAGES, default=list(STAGES))
    parser.add_argument("--widths", nargs="+", type=int, default=[128, 512, 1920], metavar="PIXELS")
    parser.add_argument("--frames", default="0:4", metavar="A:B:STEP", help="of the pose list")
    parser.add_argument("--rounds", type=int, default=3, help="times that every picture is made at each effort")
    parser.add_argument("--data", type=Path, default=Path("..", "shared", "data"), help=f"the folder that has {MESH}")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """Author each stage at each width, and make its pictures."""
    if options.quick:
        options.stages, options.widths, options.frames, options.rounds = ["sunlamp"], [120], "0:2", 1
    stages = [name for name in options.stages if name != "obj" or (options.data / MESH).is_file()]
    with quiet(), tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name:
        cases = [
            {"stage": stage, "width": width, **of_stage(author(stage, width, Path(name), options), options.rounds)}
            for stage in stages
            for width in options.widths
        ]
    return {"rounds": options.rounds, "left_out": sorted({*options.stages} - {*stages}), "cases": cases}


def author(name: str, width: int, folder: Path, options: argparse.Namespace) -> Path:
    """Author the stage `name` of STAGES, seen by SPEED+'s lens without its distortion; return its root layer."""
    camera, out = own_camera(folder / "camera.json", width), folder / f"{name}{width}"
    if name in three_stages.STAGES:
        return three_stages.author(name, out, frames=options.frames, camera=camera)
    target = ["--target", (options.data / MESH).absolute(), "--units-per-metre", 100, "--preset", "spin_sunlamp"]
    of = ["--poses", POSES, "--frames", options.frames, "--camera", camera]
    return Path(asked("author", *target, *of, "--out", out)["root"])


def of_stage(root: Path, rounds: int) -> dict[str, Any]:
    """Return the parts of a picture of the stage, milliseconds of processor, by their names in PARTS."""
    from spin_usd.commands.render.worker import Worker  # here: it loads Blender

    settings = RenderSettings(renderer="blender", effort=MORE, seed=0)
    with tempfile.TemporaryDirectory(dir=root.parent) as out:
        options = WorkerOptions(root=out, work=str(Path(out) / "work"), stage=str(root), settings=settings)
        return parts(Worker(options=to_builtins(options)), Path(out), rounds)


def parts(worker: Any, out: Path, rounds: int) -> dict[str, Any]:
    """Return what `of_stage` does, of a worker of this process that makes pictures with MORE in the folder `out`."""
    import bpy

    request = RenderRequest(options=PictureOptions(Path(worker.options.stage), renderer="blender", seed=0), effort=MORE)
    reader, renderer = worker.reader("nominal"), worker.renderer
    scenes = [reader.scene(frame) for frame in reader.frames]
    lit = [in_unit_light(scene).scene for scene in scenes]

    def rendered(effort: Effort, scene: Scene) -> int:
        return len(renderer.radiance(scene, effort, seed=0).groups)

    def undivided(scene: Scene) -> None:
        """Render as `radiance` does, but all light in one pass."""
        renderer.prepare(scene, FEW, seed=0)
        renderer._planes(scene, FEW, [])

    def made(scene: Scene) -> None:
        shutil.rmtree(out / "cache", ignore_errors=True)
        worker.picture(variant="nominal", index=scene.frame.index, kinds=request.kinds)

    def taken(make: Callable[[Scene], object], of: Sequence[Scene] = lit, *, again: bool = False) -> float:
        return milliseconds(make, of, rounds, again=again)

    few, more, many = (taken(partial(rendered, effort)) for effort in (FEW, MORE, MANY))
    sample = (many - few) / (MANY.samples - FEW.samples)
    scene = few - taken(partial(rendered, FEW), again=True)
    bands = taken(partial(picture_bands, samples=FEW.samples))
    denoised = {name: taken(partial(rendered, Effort(samples=4, denoiser=name))) for name in ("fast", "balanced")}
    found = {
        "sample": sample,
        "fixed": few - sample,
        "scene": scene,
        "bands": bands,
        "call": few - sample - scene - bands,
        "groups": few - taken(undivided),
        **{name: each - more for name, each in denoised.items()},
        "adaptive": taken(partial(rendered, Effort(samples=16, adaptive=1e-6))) - many,
        "own": taken(made, scenes) - more,
    }
    groups = rendered(FEW, lit[0])  # which settles the effort: a change of it keeps data again
    bpy.context.scene.render.use_persistent_data = False
    found["afresh"] = taken(partial(rendered, FEW)) - few
    areas = [each.picture_region.width * each.picture_region.height for each in lit]
    renderer.close()
    return {
        "faces": sum(body.target.mesh.count for body in scenes[0].bodies),
        "pictures": len(scenes),
        "box_pixels": round(statistics.fmean(areas)),
        "light_groups": groups,
        "milliseconds": {name: round(found[name], 2) for name in PARTS},
    }


def milliseconds(make: Callable[[Scene], object], scenes: Sequence[Scene], rounds: int, *, again: bool) -> float:
    """Return the milliseconds of processor for one picture: the mean over the `scenes` of each one's median of
    `rounds`, with the one before it in between. With `again` each is made at once before it counts."""
    make(scenes[-1])
    taken: list[list[float]] = [[] for _ in scenes]
    for _ in range(rounds):
        for scene, times in zip(scenes, taken, strict=True):
            if again:
                make(scene)
            began = time.process_time()
            make(scene)
            times.append(time.process_time() - began)
    return 1000 * statistics.fmean(map(statistics.median, taken))


def table(figures: dict[str, Any]) -> str:
    """Return the figures as Markdown: a column for each stage and width."""
    cases = figures["cases"]
    headings = ["milliseconds of processor", *(f"{case['stage']}, {case['width']} px" for case in cases)]
    rows = [
        ["pixels of the box", *(f"{case['box_pixels']:,}" for case in cases)],
        ["faces", *(f"{case['faces']:,}" for case in cases)],
        ["number of light groups", *(str(case["light_groups"]) for case in cases)],
        *([said, *(f"{case['milliseconds'][part]:.3g}" for case in cases)] for part, said in PARTS.items()),
    ]
    lacking = [f"\nleft out: {name}, for --data has no {MESH}" for name in figures["left_out"]]
    return "\n".join([in_markdown(headings, rows), *lacking])

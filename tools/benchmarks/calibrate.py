"""What the constants of spin_usd.planning.cost are on this machine, beside those that the file holds; and what the
trial takes here by which `plan` scales them, whose constant goes with theirs.

Pictures of stages that differ in what they need are made by one worker on one core, at several efforts; the seconds of
each kind of work are then shared out among its units with the least relative deviations, none below nothing, and those
that these pictures cannot tell apart as in the file. With --processor it is processor time that is measured: to try it
while the machine does other work.
"""

import argparse
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import three_stages
from benchmarks.command import asked
from msgspec import to_builtins
from scipy.optimize import nnls

from spin_usd.commands.render.worker_options import WorkerOptions
from spin_usd.options import PictureOptions
from spin_usd.picture.kinds import BEAUTY_PASS
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.planning.cost import EVERYWHERE, expected_work
from spin_usd.planning.machine_speed import TRIAL_S
from spin_usd.planning.make_plan import make_plan
from spin_usd.planning.request import PlanRequest, RenderRequest
from spin_usd.planning.speed_trial import trial_seconds
from spin_usd.planning.work import CommonWork, Task, work_units
from spin_usd.processes.open_renderer import renderer_entry
from spin_usd.processes.processors import hold_to, usable_cpus
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import Effort, parse_effort

EFFORTS = (
    "samples=1",
    "samples=4",
    "samples=16",
    "samples=4,bounces=0",
    "samples=1,denoiser=fast",
    "samples=1,denoiser=balanced",
    "samples=1,denoiser=high",
    "samples=4,reduction=2",
)
HELD = 0.03  # how much a constant that is twice the file's counts, beside a picture whose seconds are off by as much
MORE_STAGES = {  # besides the three: what tells their features apart
    "fills": ("--preset", "spin_synthetic"),
    "starry": ("--preset", "spin_lightbox", "--lights", "sun", "--environment", "stars"),
}


@dataclass(frozen=True, kw_only=True)
class Sample:
    """A picture that was made: its work, what was expected of it and what it took, by kind of work."""

    renderer: str
    work_units: dict[str, dict[str, float]]
    expected: dict[str, float]
    taken: dict[str, float]


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=Path, default=three_stages.POSES)
    parser.add_argument("--frames", default="::2", metavar="A:B:STEP", help="of the pose list")
    parser.add_argument("--efforts", nargs="+", default=list(EFFORTS), metavar="TEXT")
    parser.add_argument("--stages", nargs="+", default=[*three_stages.STAGES, *MORE_STAGES])
    parser.add_argument("--renderers", nargs="+", default=["blender", "raycast"])
    parser.add_argument("--processor", action="store_true", help="measure processor time instead of wall clock")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.frames, options.efforts, options.stages = "3:4", ["samples=1"], ["matt"]
        options.renderers = ["raycast"]
    hold_to(usable_cpus()[:1])
    if options.processor:
        Stopwatch.clock = staticmethod(time.process_time)
    with quiet():
        samples = list(made(options))
    renderers = dict.fromkeys(sample.renderer for sample in samples)
    return {
        "pictures": len(samples),
        "trial": {"file": TRIAL_S, "measured": round(trial_seconds(), 4)},
        "everywhere": fitted(samples, EVERYWHERE),
        "tracing": {
            name: fitted(
                [sample for sample in samples if sample.renderer == name],
                {BEAUTY_PASS: renderer_entry(name).image_costs},
            )
            for name in renderers
        },
    }


@contextmanager
def quiet() -> Iterator[None]:
    """Send what Blender prints to standard error."""
    own = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        os.dup2(own, 1)
        os.close(own)


def made(options: argparse.Namespace) -> Iterator[Sample]:
    """Make all pictures, each at all efforts."""
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name:
        for stage in options.stages:
            root = author(stage, Path(name) / stage, options)
            for renderer in options.renderers:
                for text in options.efforts:
                    effort = parse_effort(text)
                    if renderer == "blender" or effort == Effort(samples=effort.samples):
                        yield from of_run(root, renderer, effort, Path(name) / "dataset")


def author(name: str, out: Path, options: argparse.Namespace) -> Path:
    """Author the stage `name`, of the three or of MORE_STAGES."""
    if name in three_stages.STAGES:
        return three_stages.author(name, out, poses=options.poses, frames=options.frames)
    model = ["--poses", options.poses, "--target", "tango", "--camera", "speedplus", "--frames", options.frames]
    return Path(asked("author", *model, *MORE_STAGES[name], "--out", out)["root"])


def of_run(root: Path, renderer: str, effort: Effort, out: Path) -> Iterator[Sample]:
    """Make the stage's pictures, the first once more than counts: it starts the renderer."""
    from spin_usd.commands.render.worker import Worker  # here, where processors and clock are chosen

    request = RenderRequest(options=PictureOptions(root, renderer=renderer, seed=0), effort=effort)
    plan = make_plan(PlanRequest(request=request), processes=1, progress=lambda *_: None)
    width, height = plan.content.camera
    method = CommonWork(renderer=renderer, effort=effort, kinds=request.kinds, frame_pixels=width * height)
    settings = RenderSettings(renderer=renderer, effort=effort, seed=0)
    options = WorkerOptions(root=str(out), work=str(out / "work"), stage=str(root), settings=settings)
    worker = Worker(options=to_builtins(options))
    for picture in (plan.pictures[0], *plan.pictures):
        shutil.rmtree(out, ignore_errors=True)
        taken = worker.picture(variant="nominal", index=picture.index, kinds=request.kinds).seconds
        making = Task(picture=picture, label_pass=True, render=True)
        if "opening" not in taken:
            of = work_units(making, method)
            yield Sample(renderer=renderer, work_units=of, expected=expected_work(making, method), taken=taken)
    assert worker.renderer
    worker.renderer.close()


def fitted(samples: list[Sample], costs: Any) -> dict[str, Any]:
    """Return by kind of work what was taken of what was expected, and by unit the constant in the file and the measured
    one."""
    found = {}
    for work, units in costs.items():
        rows = [s for s in samples if s.taken.get(work, 0) > 0 and s.expected.get(work, 0) > 0]
        names = [name for name in units if any(s.work_units[work].get(name) for s in rows)]
        if not names:
            continue
        taken = np.array([s.taken[work] for s in rows])
        shares = np.array([[units[n] * s.work_units[work].get(n, 0.0) for n in names] for s in rows]) / taken[:, None]
        held = HELD * np.sqrt(len(rows)) * np.eye(len(names))
        scales, _ = nnls(np.vstack([shares, held]), np.concatenate([np.ones(len(rows)), np.diag(held)]))
        costs_now = {name: units[name] * scale for name, scale in zip(names, scales, strict=True)}
        ratios = shares @ scales
        found[work] = {
            "taken_over_expected": round(float(taken.sum() / sum(s.expected[work] for s in rows)), 3),
            "fit_off": round(float(np.abs(ratios - 1).max()), 3),
            "units": {n: {"file": units[n], "measured": float(f"{costs_now[n]:.3g}")} for n in names},
        }
    return found


def table(figures: dict[str, Any]) -> str:
    lines = [
        "| work | taken / expected | unit | in the file, s | measured, s | a picture off by, at most |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    parts = {"": figures["everywhere"], **{f"{name}: ": part for name, part in figures["tracing"].items()}}
    for where, works in parts.items():
        for work, found in works.items():
            for unit, cost in found["units"].items():
                of_work = f"{where}{work} | {found['taken_over_expected']:.2f}"
                costs = f"{cost['file']:.3g} | {cost['measured']:.3g}"
                lines.append(f"| {of_work} | {unit} | {costs} | {found['fit_off']:.0%} |")
    trial = figures["trial"]
    said = f"the trial of this machine takes {trial['measured']:.3g} s; of the file's, {trial['file']:.3g} s"
    return "\n".join([*lines, "", said])

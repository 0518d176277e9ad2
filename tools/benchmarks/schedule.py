"""What the constants of spin_usd.planning.wall_time are on this machine, beside those that the file holds.

Planning is timed with one picture and with many. A worker is timed from its start to the end of its first picture,
which is then made again: what it took more is the start. A planet's images are what both take longer with Earth behind.
Then the same pictures are made by one worker on one processor, by one on all, and by one on each at the same time.
"""

import argparse
import json
import math
import shutil
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import three_stages
from benchmarks.spread import shown, spread
from msgspec import to_builtins

from spin_usd.commands.render.request import plan
from spin_usd.commands.render.worker_options import WorkerOptions
from spin_usd.options import PictureOptions
from spin_usd.planning import wall_time
from spin_usd.planning.make_plan import sharing
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.wall_time import Work
from spin_usd.processes.child import Child
from spin_usd.processes.open_renderer import DEFAULT_RENDERER, default_effort
from spin_usd.processes.processors import usable_cpus
from spin_usd.scene.derived.content_keys import RenderSettings


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--many", type=int, default=2000, help="pictures that are planned")
    parser.add_argument("--pictures", type=int, default=8, help="that are made; beside one another, too")
    parser.add_argument("--renderer", default="blender")
    parser.add_argument("--rounds", type=int, default=3)


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.many, options.pictures, options.renderer, options.rounds = 2, 1, "raycast", 1
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name:
        folder = Path(name)
        poses = repeated(options.many, folder / "poses.json")
        matt, earth = (three_stages.author(stage, folder / stage, poses=poses) for stage in ("matt", "earth"))
        rounds = [of_round(options, matt, earth, folder) for _ in range(options.rounds)]
    measured = {name: spread([each[name] for each in rounds]) for name in rounds[0]}
    return {
        "rounds": options.rounds,
        "constants": {name: {"file": getattr(wall_time, name), "measured": found} for name, found in measured.items()},
    }


def repeated(count: int, file: Path) -> Path:
    """Write so many poses, the known ones again and again; returns the file."""
    known = json.loads(three_stages.POSES.read_text())
    file.write_text(json.dumps([{**known[i % len(known)], "filename": f"img{i:06d}.png"} for i in range(count)]))
    return file


def of_round(options: argparse.Namespace, matt: Path, earth: Path, folder: Path) -> dict[str, float]:
    """Measure the constants by name, as far as this machine can tell."""
    one, many, with_images = planning(matt, "0:1"), planning(matt, None), planning(earth, "0:1")
    plain, before_earth = (started(options.renderer, stage, folder) for stage in (matt, earth))
    return {
        "PLANNING_S": one,
        "PLANNED_S": (many - one) * sharing(options.many, len(usable_cpus())) / (options.many - 1),
        "START_S": plain.start,
        "OPEN_S": plain.opening,
        "IMAGES_S": (with_images - one + before_earth.all - plain.all) / 2,
        **(of_several(options, matt, folder) if len(usable_cpus()) > 1 else {}),
    }


def planning(stage: Path, frames: str | None) -> float:
    began = time.perf_counter()
    options, effort = PictureOptions(stage, frames=frames), default_effort(DEFAULT_RENDERER)
    plan(RenderRequest(options=options, effort=effort), progress=lambda *_: None)
    return time.perf_counter() - began


@dataclass(frozen=True, kw_only=True)
class Started:
    """Seconds before a worker makes pictures: to open the stage, and otherwise."""

    start: float
    opening: float

    @property
    def all(self) -> float:
        return self.start + self.opening


def started(renderer: str, stage: Path, folder: Path) -> Started:
    began = time.perf_counter()
    with Child() as child:
        maker = Maker(child, renderer, stage, folder / "started", usable_cpus()[:1])
        opening = maker.seconds(0)["opening"]
        first = time.perf_counter()
        maker.seconds(0)
        again = time.perf_counter() - first
    return Started(start=first - began - again - opening, opening=opening)


def of_several(options: argparse.Namespace, stage: Path, folder: Path) -> dict[str, float]:
    """Return by how much more processors are faster, and workers beside one another slower."""
    cpus = usable_cpus()
    with ExitStack() as stack, ThreadPoolExecutor(len(cpus)) as threads:
        held = [cpus, *([cpu] for cpu in cpus)]
        children = [stack.enter_context(Child()) for _ in held]
        on_all, *each = (
            Maker(child, options.renderer, stage, folder / f"worker {i}", held[i]) for i, child in enumerate(children)
        )
        for maker in (on_all, *each):
            maker.seconds(0)  # its first counts for its start
        wide, alone = on_all.work(options.pictures), each[0].work(options.pictures)
        beside = list(threads.map(lambda maker: maker.work(options.pictures), each))
    slower = sum(work.total for work in beside) / len(beside) / alone.total
    return {"BESIDE": slower, "SPEED_UP": math.log(alone.render / wide.render) / math.log(len(cpus))}


class Maker:
    """A worker in its process, held to those processors; `out`: its dataset, each picture of which is made from
    nothing."""

    def __init__(self, child: Child, renderer: str, stage: Path, out: Path, cpus: Sequence[int]) -> None:
        request = RenderRequest(options=PictureOptions(stage, renderer=renderer), effort=default_effort(renderer))
        settings = RenderSettings(renderer=renderer, effort=request.effort, seed=0)
        options = WorkerOptions(
            root=str(out),
            work=str(out / "work"),
            stage=str(stage),
            settings=settings,
        )
        child.call("open_worker", options=to_builtins(options), cpus=cpus)
        self._child, self._out, self._kinds = child, out, request.kinds

    def seconds(self, index: int) -> dict[str, float]:
        """Return the seconds of that picture, by kind of work."""
        shutil.rmtree(self._out, ignore_errors=True)
        answer = self._child.call("picture", variant="nominal", index=index, kinds=self._kinds)
        return dict(answer["seconds"])

    def work(self, pictures: int) -> Work:
        """Return the work of the first so many together."""
        works = [Work.of(self.seconds(index)) for index in range(pictures)]
        return Work(render=sum(work.render for work in works), rest=sum(work.rest for work in works))


def table(figures: dict[str, Any]) -> str:
    lines = ["| constant | in the file | measured |", "| --- | --- | --- |"]
    for name, found in figures["constants"].items():
        lines.append(f"| {name} | {found['file']:g} | {shown(found['measured'])} |")
    return "\n".join(lines)

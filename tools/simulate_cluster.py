"""What a run on many machines would take: `tools/simulate_cluster STAGE`.

Plans the stage's pictures, deals their frames out to shards as `render --shard` does, and simulates machines that each
make one shard, and machines that take picture by picture from one queue. What a picture takes is what the plan expects
of it times chance: pictures and machines differ. With --every K only each Kth frame is planned and stands for K;
docs/how-to/cluster.md has the figures of --every 30.
"""

import argparse
import heapq
import json
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from spin_usd.commands.render.request import common_work, plan
from spin_usd.options import PictureOptions
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import expected_bytes, expected_work
from spin_usd.planning.make_plan import sharing
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.shard import Shard
from spin_usd.planning.wall_time import OPEN_S, PLANNED_S, PLANNING_S, START_S
from spin_usd.planning.work import CommonWork, Task
from spin_usd.processes.open_renderer import default_effort
from spin_usd.store.stage_path import existing_stage

CACHE_FOLDERS = 256  # of each kind in the cache: the first two digits of a key


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stage", type=lambda text: existing_stage(Path(text)))
    parser.add_argument("--variants", default="all")
    parser.add_argument("--renderer", default="blender")
    parser.add_argument("--every", type=int, default=1, metavar="K")
    parser.add_argument("--shards", type=int, nargs="+", default=[100, 400], metavar="N")
    parser.add_argument("--machines", type=int, default=100, metavar="N")
    parser.add_argument("--workers", type=int, default=8, help="of each machine, with a core each")
    parser.add_argument(
        "--spread",
        type=float,
        nargs=2,
        default=(0.25, 0.1),
        metavar=("PICTURES", "MACHINES"),
        help="how much they differ from what is expected: standard deviations of logarithms",
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    figures = simulated(options)
    sys.stdout.write(f"{json.dumps(figures) if options.json else table(figures)}\n")


def simulated(options: argparse.Namespace) -> dict[str, Any]:
    """Return the figures of the run."""
    asked = PictureOptions(
        options.stage, variants=options.variants, renderer=options.renderer, frames=f"::{options.every}"
    )
    request = RenderRequest(options=asked, effort=default_effort(options.renderer))
    planned = plan(request, progress=lambda *_: None)
    chosen = common_work(request, planned)
    pictures = [twin for picture in planned.pictures for twin in twins(picture, options.every)]
    tasks = tasks_of(pictures, chosen)
    costs = np.array([sum(expected_work(task, chosen).values()) for task in tasks])
    rng, (of_pictures, of_machines) = np.random.default_rng(options.seed), options.spread
    seconds = costs * rng.lognormal(-(of_pictures**2) / 2, of_pictures, len(costs))
    slowness = rng.lognormal(-(of_machines**2) / 2, of_machines, options.machines)
    workers_s = START_S + OPEN_S * len(planned.variants)
    queue_s = planning_s(len(pictures), options.workers) + workers_s + in_a_queue(seconds, slowness, options.workers)
    size = sum(expected_bytes(task, chosen) for task in tasks)
    run = Run(pictures, costs, seconds, slowness, options.workers, workers_s)
    return {
        "pictures": len(pictures),
        "renders": len({picture.radiance for picture in pictures}),
        "core_hours": float(seconds.sum()) / 3600,
        "machines": options.machines,
        "workers": options.workers,
        "ideal_s": float(seconds.sum()) / options.machines / options.workers,
        "planning_s": planning_s(len(pictures), options.workers),
        "queue_s": queue_s,
        "shards": [run.of(count) for count in options.shards],
        "pictures_per_s": len(pictures) / queue_s,
        "bytes_per_s": size / queue_s,
        "files_per_folder": max(Counter(picture.variant for picture in pictures).values()),
        "files_per_cache_folder": len({picture.geometry for picture in pictures}) / CACHE_FOLDERS,
        "supervisor_bytes": psutil.Process().memory_info().rss,
    }


@dataclass(frozen=True)
class Run:
    """A run in shards. costs: what is expected of each picture · seconds: what it takes · slowness: of each machine ·
    start_s: what the workers of a shard take before its first picture."""

    pictures: Sequence[PlannedPicture]
    costs: Any
    seconds: Any
    slowness: Any
    workers: int
    start_s: float

    def of(self, count: int) -> dict[str, Any]:
        """Return the figures of so many shards, each taken by the next machine that is free."""
        frames = list(dict.fromkeys(picture.frame for picture in self.pictures))
        own = [Shard(number=number, count=count).own(frames) for number in range(count)]
        shard_of = {frames[place]: number for number, places in enumerate(own) for place in places}
        shards, alike = np.array([shard_of[picture.frame] for picture in self.pictures]), np.ones(1)
        took = [in_a_queue(self.seconds[shards == number], alike, self.workers) for number in range(count)]
        start_s = self.start_s + planning_s(len(self.pictures) // count, self.workers)
        return {
            "shards": count,
            "unequal": float(np.bincount(shards, self.costs, minlength=count).max() / (self.costs.sum() / count)) - 1,
            "planning_s": planning_s(len(self.pictures) // count, self.workers),
            "alike_s": in_a_queue([start_s + each for each in took], np.ones(len(self.slowness)), 1),
            "seconds": in_a_queue([start_s + each for each in took], self.slowness, 1),
        }


def twins(picture: PlannedPicture, count: int) -> list[PlannedPicture]:
    """Return the picture so many times, as if of other frames: its keys differ from one to the next."""
    return [picture] + [
        replace(
            picture,
            frame=f"{picture.frame}-{i}",
            geometry=f"{picture.geometry}-{i}",
            radiance=f"{picture.radiance}-{i}",
            exposure=f"{picture.exposure}-{i}",
            label_keys={name: f"{key}-{i}" for name, key in picture.label_keys.items()},
        )
        for i in range(1, count)
    ]


def tasks_of(pictures: Sequence[PlannedPicture], options: CommonWork) -> list[Task]:
    """Return the work of each picture, in their order: passes are made by the first that needs them."""
    made: set[str] = set()
    tasks = []
    for picture in pictures:
        keys = {picture.label_key(kind) for kind in options.labels}
        tasks.append(Task(picture=picture, label_pass=not keys <= made, render=picture.radiance not in made))
        made |= keys | {picture.radiance}
    return tasks


def planning_s(pictures: int, workers: int) -> float:
    """Return the seconds that a machine with so many workers plans so many pictures."""
    return PLANNING_S + PLANNED_S * pictures / sharing(pictures, workers)


def in_a_queue(seconds: Any, slowness: Any, workers: int) -> float:
    """Return the end of the last picture, when every worker of every machine takes the next one."""
    ends = [(0.0, machine) for machine in range(len(slowness)) for _ in range(workers)]
    for each in seconds:
        end, machine = ends[0]
        heapq.heapreplace(ends, (end + slowness[machine] * each, machine))
    return max(end for end, _ in ends)


def table(figures: dict[str, Any]) -> str:
    """Return the figures as Markdown."""
    f = figures
    rows = [
        ("pictures; renders that they share", f"{f['pictures']:,}; {f['renders']:,}"),
        ("work, core hours", f"{f['core_hours']:.1f}"),
        ("machines; workers of each", f"{f['machines']}; {f['workers']}"),
        ("ideal, minutes", f"{f['ideal_s'] / 60:.1f}"),
        ("one queue for all, minutes", minutes(f["queue_s"], f)),
        *((f"{each['shards']} shards, minutes", minutes(each["seconds"], f)) for each in f["shards"]),
        *((f"{each['shards']} shards, machines alike, minutes", minutes(each["alike_s"], f)) for each in f["shards"]),
        *((f"longest of {each['shards']} shards by the plan", f"{each['unequal']:+.1%}") for each in f["shards"]),
        ("to plan, minutes: all pictures", f"{f['planning_s'] / 60:.1f}"),
        *((f"to plan, seconds: one of {each['shards']} shards", f"{each['planning_s']:.0f}") for each in f["shards"]),
        ("memory of a supervisor with all pictures planned, MB", f"{f['supervisor_bytes'] / 1e6:.0f}"),
        ("pictures a second; MB a second", f"{f['pictures_per_s']:.0f}; {f['bytes_per_s'] / 1e6:.0f}"),
        ("files in a folder; in one of the cache", f"{f['files_per_folder']:,}; {f['files_per_cache_folder']:.0f}"),
    ]
    return "\n".join(["| what | figure |", "| --- | --- |", *(f"| {name} | {value} |" for name, value in rows)])


def minutes(seconds: float, figures: dict[str, Any]) -> str:
    return f"{seconds / 60:.1f} ({seconds / figures['ideal_s'] - 1:+.1%})"


if __name__ == "__main__":
    main()

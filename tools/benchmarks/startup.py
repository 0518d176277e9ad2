"""How long spin-usd takes to start: commands that do little, as a user runs them, and what their processes import.

One picture of 480x300, of the stage `matt` of three_stages; processor seconds are those of all of a command's processes
together, files are warm in the system's cache. Imports are those of each kind of process, alone, before it is asked
anything: wall-clock milliseconds by `-X importtime`, each module's own added up by library, those from 50.

Why what takes that long is imported:

- numpy: all arrays; a supervising process has the tables of labels and of content keys, which are made with it.
- pxr: a stage is composed by USD, in every process that reads one, and Python's bindings load all of its libraries.
- OpenImageIO: textures are checked while a stage is read, and labels and images are written by it.
- scipy: its spatial part has the convex hull of every target, from which the region of interest is found. A planning
  process imports it with its first picture, and a worker ahead of that.
- bpy: Blender is one library of 300 MB, and loads its user interface and its own add-ons (import and export of models,
  assets) before anybody can say that none is wanted; of these renderers.blender leaves out the manager of extensions.
- spin_usd: many small modules, whose frozen dataclasses and tables are made anew in each process.
- Python itself: argparse, inspect and dataclasses, which typer, the options and the records need.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import three_stages
from benchmarks.command import timed
from benchmarks.growth import camera
from benchmarks.spread import shown, spread

from spin_usd.commands.render.workers import HULL_MODULE, WORKER_MODULE
from spin_usd.processes.child_calls import modules_of
from spin_usd.processes.open_renderer import renderer_entry

WIDTH = 480
LEAST_MS = 50.0
CHILD = "spin_usd.processes.child_main"
COMMAND_LINE = "spin_usd.command_line"
PROCESSES: Mapping[str, Sequence[str]] = {
    "command line": (COMMAND_LINE,),
    "supervisor of render": (COMMAND_LINE, "spin_usd.commands.render.run"),
    "planning child": (CHILD, *modules_of("open_plan")),
    "worker of labels": (CHILD, WORKER_MODULE, HULL_MODULE),
    "worker of Blender": (CHILD, WORKER_MODULE, renderer_entry("blender").module, HULL_MODULE),
    "child of check": (CHILD, *modules_of("check_stage", "check_picture")),
    "child of export": (CHILD, *modules_of("export")),
}
Words = Callable[[Path, Path], Sequence[object]]
COMMANDS: Mapping[str, Words] = {
    "--help": lambda folder, out: ("--help",),
    "first label": lambda folder, out: ("render", folder / "stage", "--labels-only", "--out", out),
    "first raycast picture": lambda folder, out: ("render", folder / "stage", "--renderer", "raycast", "--out", out),
    "first Blender picture": lambda folder, out: ("render", folder / "stage", "--out", out),
    "check": lambda folder, out: ("check", folder / "dataset"),
    "export": lambda folder, out: ("export", folder / "dataset", "--to", "coco", "--out", out),
}
"""By name the words of a command, in a folder with a `stage` and a `dataset` of it, that may write into `out`."""


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--commands", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    parser.add_argument("--rounds", type=int, default=5)


def measure(options: argparse.Namespace) -> dict[str, Any]:
    rounds = 1 if options.quick else options.rounds
    taken: dict[str, list[dict[str, float]]] = {name: [] for name in options.commands}
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name:
        folder = Path(name)
        (folder / "camera.json").write_text(json.dumps(camera(WIDTH)))
        three_stages.author("matt", folder / "stage", frames="0:1", camera=str(folder / "camera.json"))
        timed("render", folder / "stage", "--out", folder / "dataset")
        for _ in range(rounds):  # in turn: what else the machine does meets all alike
            for command in options.commands:
                with tempfile.TemporaryDirectory(dir=folder) as fresh:
                    taken[command].append(timed(*COMMANDS[command](folder, Path(fresh) / "out"))[1])
    commands = {
        command: {kind: spread([each[kind] for each in runs]) for kind in ("wall_s", "cpu_s")}
        for command, runs in taken.items()
    }
    return {"rounds": rounds, "commands": commands, "imports_ms": {kind: slow(kind, rounds) for kind in PROCESSES}}


def slow(kind: str, rounds: int) -> dict[str, float]:
    """Return by library the milliseconds of its imports in a process of that kind, medians, the slowest first."""
    each = [of_libraries(imported(PROCESSES[kind])) for _ in range(rounds)]
    found = {library: statistics.median(one.get(library, 0.0) for one in each) for library in each[0]}
    return {name: round(ms) for name, ms in sorted(found.items(), key=lambda item: -item[1]) if ms >= LEAST_MS}


def imported(modules: Sequence[str]) -> str:
    """Import the modules in a Python of its own; return what it says of the time of each."""
    script = f"import os, {', '.join(modules)}\nos._exit(0)"  # the interpreter's teardown with bpy loaded can hang
    command = [sys.executable, "-P", "-X", "importtime", "-c", script]
    return subprocess.run(command, check=True, capture_output=True, text=True).stderr


def of_libraries(report: str) -> dict[str, float]:
    """Add up by library the milliseconds of a `report` of `-X importtime` that each module took without those that it
    imports."""
    found: dict[str, float] = defaultdict(float)
    for line in report.splitlines():
        own, _, rest = line.removeprefix("import time:").partition("|")
        if own.strip().isdecimal():  # not the head of the table, nor what libraries print
            library = rest.rpartition("|")[2].strip().partition(".")[0]
            found["Python itself" if library in sys.stdlib_module_names else library] += int(own) / 1000
    return dict(found)


def table(figures: dict[str, Any]) -> str:
    lines = ["| command | wall, s | CPU, s |", "| --- | --- | --- |"]
    for command, found in figures["commands"].items():
        lines.append(f"| {command} | {shown(found['wall_s'])} | {shown(found['cpu_s'])} |")
    lines += ["", f"| process | imports from {LEAST_MS:g} ms, by library |", "| --- | --- |"]
    for kind, found in figures["imports_ms"].items():
        lines.append(f"| {kind} | {', '.join(f'{library} {ms:g}' for library, ms in found.items())} |")
    return "\n".join(lines)

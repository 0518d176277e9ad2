"""How long `spin-usd watch` takes from the saving of a layer to its pictures: pose, light, material or lens edited.

The stage is that of three_stages in its own size, its files saved as most editors do: a new file takes the old one's
place. The preview counts as there when its image has been fetched from the page's server, and so does Blender's.
"""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import Any

import three_stages

ROOT_LAYER = """#usda 1.0
(
    defaultPrim = "World"
    endTimeCode = 0
    metersPerUnit = 1
    renderSettingsPrimPath = "/Render/Settings"
    startTimeCode = 0
    subLayers = [@./dataset.usda@]
    timeCodesPerSecond = 24
    upAxis = "Z"
)
"""
Edit = Callable[[Path, int], tuple[Path, str]]


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--stages", nargs="+", default=list(three_stages.STAGES), choices=three_stages.STAGES)
    parser.add_argument("--repeats", type=int, default=7, help="of each edit")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.stages, options.repeats = ["matt"], 1
    return {"repeats": options.repeats, "stages": {name: of_stage(name, options.repeats) for name in options.stages}}


def of_stage(name: str, repeats: int) -> dict[str, Any]:
    """Return the median seconds to the preview and to Blender's picture after each kind of edit."""
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder:
        stage = three_stages.author(name, Path(folder) / "stage", frames="1:2").parent
        root = stage / "edited.usda"
        root.write_text(ROOT_LAYER)
        command = [sys.executable, "-m", "spin_usd.command_line", "watch", str(root), "--frame", "0", "--port", "0"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout
            try:
                return _measured(process.stdout.readline().split()[0], stage, repeats)
            finally:
                process.send_signal(signal.SIGINT)


def _measured(address: str, stage: Path, repeats: int) -> dict[str, Any]:
    with urllib.request.urlopen(f"{address}state") as stream:
        states = _states(stream)
        _shown(states, "blender")
        return {kind: _edited(address, states, stage, edit, repeats) for kind, edit in EDITS.items()}


def _edited(address: str, states: Iterator[Any], stage: Path, edit: Edit, repeats: int) -> dict[str, float]:
    taken: dict[str, list[float]] = {"raycast": [], "blender": []}
    for number in range(repeats):
        file, text = edit(stage, number + 1)
        beside = file.with_name(".beside")
        beside.write_text(text)
        began = time.monotonic()
        os.replace(beside, file)
        for light, seconds in taken.items():
            _shown(states, light)
            urllib.request.urlopen(f"{address}picture/image").read()
            seconds.append(time.monotonic() - began)
    return {"preview": median(taken["raycast"]), "blender": median(taken["blender"])}


def _states(stream: Any) -> Iterator[Any]:
    for line in stream:
        if line.startswith(b"data: "):
            yield json.loads(line.removeprefix(b"data: "))


def _shown(states: Iterator[Any], light: str) -> None:
    """Wait for an image by that renderer."""
    for each in states:
        assert each["status"] != "faulty", each["message"]
        if each["status"] == "shown" and each["light"] == light:
            return


def _over(stage: Path, prim: str, text: str) -> tuple[Path, str]:
    return stage / "edited.usda", f'{ROOT_LAYER}\nover "World"\n{{\nover "{prim}"\n{{\n{text}\n}}\n}}\n'


def _pose(stage: Path, number: int) -> tuple[Path, str]:
    return _over(stage, "Target", f"double3 xformOp:translate = (0.05, {5 + 0.1 * number}, 0)")


def _lens(stage: Path, number: int) -> tuple[Path, str]:
    return _over(stage, "Camera", f"double spin:lens:fx = {2900 + number}")


def _light(stage: Path, number: int) -> tuple[Path, str]:
    return _replaced(
        stage / "layers" / "lights.usda", r"inputs:intensity = [\d.]+", f"inputs:intensity = {50 + number}"
    )


def _material(stage: Path, number: int) -> tuple[Path, str]:
    (file,) = (stage / "targets" / "tango").glob("matt.usda")
    return _replaced(file, r"inputs:roughness = [\d.]+", f"inputs:roughness = {0.5 + number / 100}")


def _replaced(file: Path, pattern: str, text: str) -> tuple[Path, str]:
    edited, count = re.subn(pattern, text, file.read_text(), count=1)
    assert count, f"{file} has no {pattern}"
    return file, edited


EDITS: dict[str, Edit] = {"pose": _pose, "light": _light, "material": _material, "lens": _lens}


def table(figures: dict[str, Any]) -> str:
    lines = ["| stage | edit of | preview and labels, s | Blender's picture, s |", "| --- | --- | --- | --- |"]
    for stage, found in figures["stages"].items():
        for kind, taken in found.items():
            lines.append(f"| {stage} | {kind} | {taken['preview']:.2f} | {taken['blender']:.2f} |")
    return "\n".join(lines)

"""One model by others through author, check and render, as a user would call them."""

import json
import shutil
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from real_files.source import Source, source_of

SIZE_PX, FOCAL_PX = 160, 400.0
RADII_AWAY = 6.0  # the target's bounding sphere fills five sixths of the frame
ATTITUDE = (0.33, 0.88, -0.20, 0.28)  # three quarters from above, whatever axis is up; scalar first
SAMPLES = 16
PATIENCE_S = 240


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """folder: where to work · command: the spin-usd to call · compare: with Blender's own importer too."""

    file: Path
    folder: Path
    command: str
    renderer: str
    compare: bool


def tried(attempt: Attempt) -> dict[str, Any]:
    """What came of it: a report of each step, as far as it went, and the bounds by all who read it."""
    shutil.rmtree(attempt.folder, ignore_errors=True)
    attempt.folder.mkdir(parents=True)
    outcome: dict[str, Any] = {}
    try:
        source = source_of(attempt.file)
        outcome["source"] = asdict(source)
    except (ValueError, subprocess.TimeoutExpired) as error:
        outcome["source_error"] = str(error)[-200:]
        source = Source(low=(-1, -1, -1), high=(1, 1, 1), units_per_metre=1.0)
    _write_inputs(attempt.folder, source)
    units = [] if source.units_per_metre is None else ["--units-per-metre", f"{source.units_per_metre:g}"]
    choices = ["--poses", "poses.json", "--camera", "camera.json", "--target", str(attempt.file.resolve())]
    outcome["author"] = _call(attempt, "author", *choices, *units, "--any-size", "--out", "stage", "--json")
    if outcome["author"]["exit"] == 0:
        outcome["check"] = _findings(_call(attempt, "check", "stage", "--json"))
        how = ["--renderer", attempt.renderer, "--samples", str(SAMPLES), "--radiance", "--out", "dataset"]
        outcome["render"] = _call(attempt, "render", "stage/dataset.usda", *how)
        outcome |= _script("ours.py", attempt.folder)
        if attempt.compare and outcome["render"]["exit"] == 0:
            scale = str(1 / (source.units_per_metre or 1))
            outcome["blender"] = _script("beside_blender.py", attempt.folder, attempt.file.resolve(), scale)
    return outcome


def _write_inputs(folder: Path, source: Source) -> None:
    """A camera, and one pose that shows the whole model."""
    centre = (np.array(source.low) + source.high) / 2
    radius = float(np.linalg.norm(np.array(source.high) - source.low) / 2) or 1.0
    matrix = [[FOCAL_PX, 0, SIZE_PX / 2], [0, FOCAL_PX, SIZE_PX / 2], [0, 0, 1]]
    camera = {"Nu": SIZE_PX, "Nv": SIZE_PX, "cameraMatrix": matrix, "distCoeffs": [0, 0, 0, 0, 0]}
    (folder / "camera.json").write_text(json.dumps(camera))
    w, *v = np.array(ATTITUDE) / np.linalg.norm(ATTITUDE)
    turned = centre + 2 * np.cross(v, np.cross(v, centre) + w * centre)
    pose = {
        "filename": "picture.png",
        "q_vbs2tango_true": [w, *v],
        "r_Vo2To_vbs_true": (np.array([0, 0, RADII_AWAY * radius]) - turned).tolist(),
    }
    (folder / "poses.json").write_text(json.dumps([pose]))


def _call(attempt: Attempt, *arguments: str) -> dict[str, Any]:
    """Exit code, seconds, and what was said, of one command."""
    began = time.monotonic()
    try:
        done = subprocess.run(
            [attempt.command, *arguments], cwd=attempt.folder, capture_output=True, text=True, timeout=PATIENCE_S
        )
        code, out, said = done.returncode, done.stdout, done.stderr
    except subprocess.TimeoutExpired:
        code, out, said = -1, "", f"no answer within {PATIENCE_S} s"
    return {"exit": code, "seconds": round(time.monotonic() - began, 1), "out": out, "said": said[-1500:]}


def _findings(checked: dict[str, Any]) -> dict[str, Any]:
    """The same with only the codes of what was found, each once."""
    out = checked.pop("out")
    found = json.loads(out)["findings"] if out.startswith("{") else []
    return {**checked, "findings": sorted({f"{each['severity']} {each['code']}" for each in found})}


def _script(name: str, *arguments: Path | str) -> dict[str, Any]:
    """What a script of this folder prints as JSON, or why it does not."""
    command = [sys.executable, str(Path(__file__).with_name(name)), *map(str, arguments)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        return {"error": f"no answer within {PATIENCE_S} s"}
    if done.returncode:
        return {"error": (done.stderr.strip().splitlines() or [f"exit {done.returncode}"])[-1]}
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found

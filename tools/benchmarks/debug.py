"""How far the .blend of `spin-usd debug`, rendered by plain bpy, is from the radiance that `render` makes.

The first picture of each stage of three_stages, and of two bodies under the lamps of the lightbox, with the same
samples and seed and no denoiser. The .blend is rendered in a process that has none of our code. The difference is taken
in the pixels that targets cover wholly: its root mean square and its mean, each as a share of the radiance's.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import three_stages
from benchmarks.command import asked
from benchmarks.frames import own_camera
from benchmarks.growth import WIDTH

import spin_usd
from spin_usd import resources
from spin_usd.accuracy.tables import in_markdown
from spin_usd.files.folder import FileIn, Folder
from spin_usd.formats.array_file import read_array

FRAME = "0:1"
BODIES = "two bodies, lightbox"
STAGES = (*three_stages.STAGES, BODIES)
BESIDE = (0.8, -0.3, 0.5)  # metres: of the second body from the first, in the camera's axes
PLAIN = """
import os, sys
import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
bpy.context.scene.render.filepath = sys.argv[2]
bpy.ops.render.render(write_still=True)
os._exit(0)
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--samples", type=int, default=16, help="a pixel")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    samples = 2 if options.quick else options.samples
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name:
        folder = Path(name)
        camera = own_camera(folder / "camera.json", WIDTH // 4) if options.quick else "speedplus"
        stages = {name: author(name, folder / name, camera) for name in STAGES}
        return {"samples": samples, "stages": {name: difference(stage, samples) for name, stage in stages.items()}}


def author(name: str, out: Path, camera: str) -> Path:
    """Author the stage of that name into the new folder `out`; returns its root layer."""
    if name != BODIES:
        return three_stages.author(name, out, frames=FRAME, camera=camera)
    poses = json.loads(three_stages.POSES.read_text())
    for pose in poses:
        pose["r_Vo2To_vbs_true"] = np.add(pose["r_Vo2To_vbs_true"], BESIDE).tolist()
    also = out.with_name("also.json")
    also.write_text(json.dumps(poses))
    cubesat = resources.stages() / "targets" / "cubesat" / "cubesat.usda"
    bodies = ("--poses", three_stages.POSES, "--target", "tango", "--also", f"{cubesat}:{also}")
    chosen = ("--camera", camera, "--lights", "lightbox", "--frames", FRAME)
    return Path(asked("author", *bodies, *chosen, "--out", out)["root"])


def difference(stage: Path, samples: int) -> dict[str, Any]:
    """Return by how much the .blend's picture differs from our radiance, and of how many pixels."""
    effort, folder = f"samples={samples}", stage.parent
    spin_usd.debug(stage, "0", out=folder / "picture.blend", effort=effort)
    command: list[str | Path] = [sys.executable, "-I", "-c", PLAIN, folder / "picture.blend", folder / "picture.exr"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    spin_usd.render(stage, out=folder / "made", effort=effort, labels="none", radiance=True, workers=1)
    ours = spin_usd.Dataset(folder / "made")[0].label("radiance").astype(np.float64)
    covered = ours[..., 3] >= 1
    truth, found = ours[covered, :3], read_array(FileIn(Folder(folder), "picture.exr"))[covered, :3]
    rms = float(np.sqrt(((found - truth) ** 2).mean() / (truth**2).mean()))
    return {
        "frame": [ours.shape[1], ours.shape[0]],
        "pixels": int(covered.sum()),
        "rms": rms,
        "mean": float(found.mean() / truth.mean() - 1),
    }


def table(figures: dict[str, Any]) -> str:
    """Return the figures as a table."""
    rows = [[name, f"{of['rms']:.1e}", f"{of['mean']:+.1e}"] for name, of in figures["stages"].items()]
    return in_markdown(("stage", "root mean square", "mean"), rows)

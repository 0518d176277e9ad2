"""The three stages that speed and accuracy are measured on.

matt: matt materials, one Sun, black sky · sunlamp: reflective, the preset spin_sunlamp · earth: the preset
spin_synthetic with Earth behind, which lights the target too. Tango through the lens of SPEED+; all three with the
detector of spin_synthetic, for the published spin_sunlamp has one without noise, to which no picture is good enough.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from spin_usd.basics import resources

POSES = resources.stages() / "examples" / "tango_speedplus_poses.json"
PRESETS = resources.stages() / "presets"
STAGES = {
    "matt": ("--preset", "spin_synthetic", "--lights", "sun"),
    "sunlamp": ("--preset", "noisy_sunlamp.usda"),
    "earth": ("--preset", "spin_synthetic", "--environment", "earth_full"),
}
NOISE = ("gain", "readNoise")


def author(name: str, out: Path, *, poses: Path = POSES, frames: str | None = None, camera: str = "speedplus") -> Path:
    """Author the stage `name` of STAGES into the folder `out` of the poses that `frames`, A:B:STEP, chooses, seen by
    the `camera`, a name or the absolute path of a file; returns its root layer. One that is there already stays as it
    is."""
    out = out.absolute()
    root = out / "dataset.usda"
    if root.is_file():
        return root
    of = [
        "--poses",
        str(poses.absolute()),
        "--target",
        "tango",
        "--camera",
        camera,
        *STAGES[name],
        "--out",
        str(out),
    ]
    chosen = ["--frames", frames] if frames else []
    command = [sys.executable, "-m", "spin_usd.command_line", "--quiet", "author", *of, *chosen]
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder:
        (Path(folder) / "noisy_sunlamp.usda").write_text(noisy_sunlamp())
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=folder)
    return root


def noisy_sunlamp() -> str:
    """The preset spin_sunlamp with the detector's noise of spin_synthetic."""
    noisy, text = ((PRESETS / f"spin_{name}.usda").read_text() for name in ("synthetic", "sunlamp"))
    for name in NOISE:
        (line,) = (line for line in noisy.splitlines() if f"spin:sensor:{name} =" in line)
        without = f"        double spin:sensor:{name} = 0\n"
        assert without in text, "the preset spin_sunlamp says something else of its detector"
        text = text.replace(without, f"{line}\n")
    return text

"""How the cost of `spin-usd render` grows with pictures, variants, faces, pixels and samples.

Of one case at a time one number is changed; each is a dataset made from nothing by the command line, all of a round
in turn. The target is a bumpy ball of as many faces as wanted, the lens SPEED+'s, smaller or larger with its image.
"""

import argparse
import json
import statistics
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from benchmarks.command import asked, run
from benchmarks.spread import line, spread

from spin_usd import resources

POSES = resources.stages() / "examples" / "tango_speedplus_poses.json"
RELIGHT = 'schema = "augment-1"\nseed = 0\n\n[[augmentation]]\nname = "v"\ncount = {count}\n\n[augmentation.sample]\n'
RELIGHT += '"sun.direction" = {{ distribution = "directions", per = "frame" }}\n'
WIDTH, HEIGHT, FOCAL = 1920, 1200, 2988.5795163815555
BUMPS = 0.05  # of the ball's radius, so that it shadows itself a little


@dataclass(frozen=True, kw_only=True)
class Case:
    """A dataset: so many pictures in so many variants, each with its own direction of the Sun; of a target of 20 times
    a power of 4 faces; the image's width in pixels; samples."""

    pictures: int = 4
    variants: int = 1
    faces: int = 20480
    width: int = 960
    samples: int = 8


BASE = Case()
SWEEPS: dict[str, tuple[int, ...]] = {
    "pictures": (1, 4, 16, 64),
    "variants": (1, 2, 4, 8),
    "faces": (1280, 20480, 327680, 1310720),
    "width": (480, 960, 1920, 3840),
    "samples": (1, 8, 32, 128),
}
QUICK_BASE = Case(pictures=1, faces=320, width=120, samples=1)
QUICK: dict[str, tuple[int, ...]] = {"pictures": (1, 2), "variants": (1, 2), "width": (120, 240)}
AGAINST = {"width": "pixels"}  # what the cost of a sweep is a line against, where it is not the number itself


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--sweeps", nargs="+", choices=SWEEPS, default=list(SWEEPS))
    parser.add_argument("--rounds", type=int, default=1)


def measure(options: argparse.Namespace) -> dict[str, Any]:
    base, known = (QUICK_BASE, QUICK) if options.quick else (BASE, SWEEPS)
    sweeps = {name: known[name] for name in options.sweeps if name in known}
    cases = dict.fromkeys([base, *(replace(base, **{n: v}) for n, values in sweeps.items() for v in values)])
    taken: dict[Case, list[dict[str, float]]] = {case: [] for case in cases}
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as folder:
        stages = {case: author(case, Path(folder) / str(i)) for i, case in enumerate(cases)}
        for _ in range(1 if options.quick else options.rounds):
            for case, stage in stages.items():
                taken[case].append(timed(case, stage, Path(folder) / "dataset"))
    found = {name: list(of_sweep(name, values, base, taken)) for name, values in sweeps.items()}
    return {"base": vars(base), "sweeps": {name: fitted(name, rows) for name, rows in found.items()}}


def author(case: Case, folder: Path) -> Path:
    """Author the stage of the case; returns its root layer."""
    folder.mkdir()
    known = json.loads(POSES.read_text())
    poses = [{**known[i % len(known)], "filename": f"img{i:06d}.png"} for i in range(case.pictures)]
    (folder / "poses.json").write_text(json.dumps(poses))
    (folder / "camera.json").write_text(json.dumps(camera(case.width)))
    ball(case.faces).export(folder / "ball.ply")
    model = ["--target", folder / "ball.ply", "--camera", folder / "camera.json", "--units-per-metre", 1]
    root = Path(asked("author", "--poses", folder / "poses.json", *model, "--out", folder / "stage")["root"])
    if case.variants > 1:
        (folder / "relight.toml").write_text(RELIGHT.format(count=case.variants - 1))
        asked("augment", root, "--spec", folder / "relight.toml")
    return root


def camera(width: int) -> dict[str, Any]:
    """Return SPEED+'s lens without its distortion, on an image of that width."""
    scale = width / WIDTH
    height, focal = round(HEIGHT * scale), FOCAL * scale
    return {
        "Nu": width,
        "Nv": height,
        "ppx": 5.86e-6 / scale,
        "ppy": 5.86e-6 / scale,
        "fx": 0.0176,
        "fy": 0.0176,
        "ccx": width / 2,
        "ccy": height / 2,
        "cameraMatrix": [[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]],
        "distCoeffs": [0, 0, 0, 0, 0],
    }


def ball(faces: int) -> trimesh.Trimesh:
    """Return a ball of 0.5 m radius, with bumps."""
    mesh: trimesh.Trimesh = trimesh.creation.icosphere(subdivisions=round(np.log(faces / 20) / np.log(4)), radius=0.5)
    mesh.vertices *= 1 + BUMPS * np.sin(9 * mesh.vertices / 0.5).prod(1, keepdims=True)
    return mesh


def timed(case: Case, stage: Path, out: Path) -> dict[str, float]:
    """Run into a fresh folder, which is emptied again; returns seconds of wall clock and of processor in all its
    processes, and bytes of memory in the largest of them."""
    with tempfile.TemporaryDirectory(dir=out.parent) as fresh:
        variants = ["--variants", "all"] if case.variants > 1 else []
        done = run("render", stage, "--effort", f"samples={case.samples}", *variants, "--out", Path(fresh) / "dataset")
    return {"wall_s": done.wall_s, "cpu_s": done.cpu_s, "memory_bytes": done.memory_bytes}


def of_sweep(
    name: str, values: Sequence[int], base: Case, taken: dict[Case, list[dict[str, float]]]
) -> Iterator[dict[str, Any]]:
    for value in values:
        runs = taken[replace(base, **{name: value})]
        spreads = {kind: spread([each[kind] for each in runs]) for kind in ("wall_s", "cpu_s")}
        memory = statistics.median(each["memory_bytes"] for each in runs)
        yield {name: value, **spreads, "memory_mb": round(memory / 1e6)}


def fitted(name: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the sweep with a straight line through its processor seconds, against pixels for the width."""
    numbers = [row[name] for row in rows]
    against = [w * round(HEIGHT * w / WIDTH) for w in numbers] if name in AGAINST else numbers
    cpu = line(against, [row["cpu_s"]["median"] for row in rows])
    return {"rows": rows, "against": AGAINST.get(name, name), "cpu": cpu}


def table(figures: dict[str, Any]) -> str:
    """Return the figures as Markdown: of each sweep its numbers, and what one more of them costs."""
    lines = ["| of | numbers | wall s | CPU s | CPU s for one more | CPU s for none |", "| --- " * 6 + "|"]
    for name, sweep in figures["sweeps"].items():
        cells = [" · ".join(texts) for texts in zip(*(_cells(name, row) for row in sweep["rows"]), strict=True)]
        fit = sweep["cpu"]
        lines.append(f"| {sweep['against']} | {' | '.join(cells)} | {fit['slope']:.3g} | {fit['intercept']:.3g} |")
    base = ", ".join(f"{value} {name}" for name, value in figures["base"].items())
    return "\n".join([*lines, f"\nwhat is not changed: {base}"])


def _cells(name: str, row: dict[str, Any]) -> tuple[str, str, str]:
    return str(row[name]), f"{row['wall_s']['median']:.3g}", f"{row['cpu_s']['median']:.3g}"

"""Seconds per frame of spin_usd beside a plain full-frame bpy script, frame by frame in turn, in one run."""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from spin_usd import resources
from spin_usd.dataset.child import Child
from spin_usd.dataset.job import Job
from spin_usd.dataset.render import RenderRequest, usable_cpus
from spin_usd.scene.effort import Effort
from spin_usd.scene.keys import RenderSettings
from spin_usd.stage.read import StageReader

CYCLES = ("label pass", "beauty pass")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", default=str(resources.stages() / "examples" / "tango_speedplus_poses.json"))
    parser.add_argument("--target", default="tango")
    parser.add_argument("--units-per-metre", type=float)
    parser.add_argument("--camera", default="speedplus")
    parser.add_argument("--frames", default="0:20", metavar="A:B")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--cpus", type=int, default=len(usable_cpus()), help="processors that each side may use")
    parser.add_argument("--json", type=Path, help="also write the figures here")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as folder:
        figures = measure(options, Path(folder))
    print(table(figures))
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n")


def measure(options: argparse.Namespace, folder: Path) -> dict[str, object]:
    """Author the stage, then make every frame with each of the three in turn."""
    stage = author(options, folder)
    cpus = usable_cpus()[: options.cpus]
    os.sched_setaffinity(0, cpus)  # the plain script inherits it
    reader = StageReader(stage)
    plain = start_plain(reader, options.samples, folder)
    ours = {name: start_ours(stage, folder, name, options.samples, cpus) for name in ("blender", "raycast")}
    rows = []
    for index in range(-1, len(reader.frames)):  # the first round warms all three up and does not count
        frame = max(index, 0)
        row: dict[str, object] = {"plain": ask_plain(plain, reader, frame)}
        for name, child in ours.items():
            kinds = RenderRequest(stage=stage, image=name == "blender").kinds
            began = time.perf_counter()
            answer = child.call("picture", variant="nominal", index=frame, kinds=kinds)
            row[name] = {"total": time.perf_counter() - began, **answer["seconds"]}
        if index >= 0:
            rows.append(row)
    for child in ours.values():
        child.close()
    return {"samples": options.samples, "cpus": len(cpus), "frames": rows}


def author(options: argparse.Namespace, folder: Path) -> Path:
    with Child() as child:
        report = child.call(
            "author",
            poses=str(Path(options.poses).absolute()),
            target=options.target,
            camera=options.camera,
            out=str(folder / "stage"),
            units_per_metre=options.units_per_metre,
            frames=options.frames,
        )
    return Path(report["root"])


def start_ours(stage: Path, folder: Path, renderer: str, samples: int, cpus: list[int]) -> Child:
    settings = RenderSettings(renderer=renderer, effort=Effort(samples=samples), seed=0)
    job = Job(root=str(folder / renderer), stage=str(stage), image_suffix=".png", settings=settings)
    child = Child(scratch=folder)
    child.call("open_worker", job=job.as_json(), cpus=cpus)
    return child


def start_plain(reader: StageReader, samples: int, folder: Path) -> subprocess.Popen[str]:
    scene = reader.scene(reader.frames[0])
    camera, mesh, material = scene.camera, scene.target.mesh, scene.target.materials[0]
    x, y, z = scene.lights[0].direction_cam
    np.savez(
        folder / "scene.npz",
        camera=[camera.width, camera.height, camera.fx, camera.cx, camera.cy],
        points=mesh.points,
        faces=mesh.faces,
        color=material.diffuse_color,
        metal_rough=[material.metallic, material.roughness],
        sun=[x, -y, -z, scene.lights[0].irradiance[0]],
    )
    command = [sys.executable, str(Path(__file__).with_name("bench_plain.py")), str(folder / "scene.npz"), str(folder)]
    plain = subprocess.Popen(
        [*command, str(samples)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert plain.stdout is not None
    assert plain.stdout.readline().strip() == "ready", "the plain script did not start"
    return plain


def ask_plain(plain: subprocess.Popen[str], reader: StageReader, index: int) -> float:
    assert plain.stdin is not None
    assert plain.stdout is not None
    pose = reader.scene(reader.frames[index]).T_cam_body
    print(*pose.rotation.ravel(), *pose.translation, file=plain.stdin, flush=True)
    return float(plain.stdout.readline())


def table(figures: dict[str, object]) -> str:
    """The figures as Markdown: mean, median, least and most seconds per frame."""
    rows = figures["frames"]
    assert isinstance(rows, list)
    lines = [
        f"{len(rows)} frames, {figures['samples']} samples, {figures['cpus']} processors; seconds per frame",
        "",
        "| what | mean | median | least | most |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, seconds in columns(rows):
        spread = (statistics.fmean(seconds), statistics.median(seconds), min(seconds), max(seconds))
        lines.append(f"| {name} | " + " | ".join(f"{s:.3f}" for s in spread) + " |")
    plain, ours = ([row["plain"] for row in rows], [row["blender"]["total"] for row in rows])
    each = [p / o for p, o in zip(plain, ours, strict=True)]
    lines += [
        "",
        f"plain over spin_usd: {sum(plain) / sum(ours):.2f} in total; per frame {min(each):.2f} to {max(each):.2f}",
    ]
    return "\n".join(lines)


def columns(rows: list[dict[str, dict[str, float]]]) -> Iterator[tuple[str, list[float]]]:
    yield "plain bpy script, full frame", [row["plain"] for row in rows]  # type: ignore[misc]
    yield "spin_usd, blender: image and labels", [row["blender"]["total"] for row in rows]
    for work in [*CYCLES, "stage", "labels", "sensor", "files"]:
        name = "files, not hidden by the passes" if work == "files" else work
        yield f"— {name}", [row["blender"].get(work, 0.0) for row in rows]
    rest = [row["blender"]["total"] - sum(row["blender"][work] for work in CYCLES) for row in rows]
    yield "— everything that is not a pass", rest
    yield "spin_usd, raycast: labels only", [row["raycast"]["total"] for row in rows]
    for work in ("label pass", "labels", "files"):
        yield f"— {work} (raycast)", [row["raycast"].get(work, 0.0) for row in rows]


if __name__ == "__main__":
    main()

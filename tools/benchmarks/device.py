"""Seconds per picture on a graphics processor beside the CPU of the same machine, and how far its light is off.

Each row is a process of its own: a device, a stage, a width. Rows run in an order in which the first say most, until
--minutes are over; --json has each as soon as it is there, and a row that it has is not taken again. Errors are those
of `spin-usd measure`: against a reference of the CPU, in linear light, over the target's pixels. --prepare authors the
stages alone, into --work, on another machine.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any

import three_stages
from benchmarks.command import COMMAND, asked
from benchmarks.frames import own_camera

from spin_usd.accuracy.tables import in_markdown, number, percent
from spin_usd.scene.effort import QUALITIES

STAGES = ("matt", "plain", "sunlamp", "earth", "two")
TWO = ("--sample", "range=6..9 inside=1 count=4", "--target", "tango", "--also", "tango:distance=2..5", "--seed", "1")
LENS = 0  # the width that stands for SPEED+'s own lens, 1920 pixels with its distortion
WIDTHS = (256, 512, 1920, LENS)
ROUNDS = 3  # times that every picture is made at a quality, but for the slow ones
REFERENCE = {"parts": 4, "samples": 512, "bounces": 32}
QUICK = 96  # pixels
RUN: dict[str, Any] = {"frames": 96, "width": 512, "quality": "draft"}  # of whole runs
PATIENCE_S = 240  # for one row
COMPILING_S = 1200  # for the first picture of a device, which a driver may compile kernels for


@dataclass(frozen=True, kw_only=True)
class Row:
    """What one process measures. kind: one of KINDS · workers: of a run."""

    kind: str
    device: str
    stage: str = "matt"
    width: int = 512
    workers: int = 1

    @property
    def name(self) -> str:
        lens = "lens" if self.width == LENS else f"{self.width}"
        return " ".join([self.kind, self.device, self.stage, lens, f"x{self.workers}"])


def rows(devices: list[str], *, quick: bool) -> Iterator[Row]:
    """Yield all rows, those first that say most."""
    if quick:
        yield Row(kind="pictures", device="cpu", width=QUICK)
        yield Row(kind="run", device="cpu")
        yield Row(kind="kill", device="cpu")
        return
    for device, stage in product(devices, ("plain", "matt")):  # whose lens takes kernels of its own
        if able(device, stage, 512):
            yield Row(kind="first", device=device, stage=stage)
    for stage, device in product(("plain", "matt"), ("cpu", *devices)):
        if able(device, stage, 512):
            yield Row(kind="pictures", device=device, stage=stage)
    for device, workers in product((*devices, "cpu"), (1, 2, 4)):
        yield Row(kind="run", device=device, workers=workers if device != "cpu" else 4 * workers)
    yield from (Row(kind="refusal", device=device, width=LENS) for device in devices if not able(device, "matt", LENS))
    yield from (Row(kind="kill", device=device) for device in devices[:1])
    yield from (Row(kind="denoiser", device=device) for device in devices[:1])
    for width, stage in product((LENS, 512, 256, 1920), STAGES):
        for device in ("cpu", *devices):
            if able(device, stage, width):
                yield Row(kind="pictures", device=device, stage=stage, width=width)


def able(device: str, stage: str, width: int) -> bool:
    """Return whether the device renders pictures through that lens: only that of `plain` neither distorts nor blurs."""
    return device in ("cpu", "optix") or (stage == "plain" and width != LENS)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--minutes", type=float, default=10, help="after which no further row begins")
    parser.add_argument("--devices", nargs="+", default=["optix", "cuda"], metavar="DEVICE")
    parser.add_argument("--work", type=Path, default=Path("device-bench"), help="folder of stages and references")
    parser.add_argument("--prepare", action="store_true", help="author the stages, and measure nothing")
    parser.add_argument("--row", help=argparse.SUPPRESS)  # a Row as JSON: measure it, and print what it found


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        RUN.update(frames=4, width=QUICK)
        REFERENCE.update(samples=4)
    if options.row:
        asked_for = Row(**json.loads(options.row))
        print(json.dumps({"found": KINDS[asked_for.kind](asked_for, options.work)}))
        sys.stdout.flush()
        os._exit(0)
    options.work = options.work.absolute()
    options.work.mkdir(parents=True, exist_ok=True)
    if options.prepare:
        for stage, width in product(STAGES, WIDTHS):
            author(stage, width, options.work)
        author("run", RUN["width"], options.work)
        return {"rows": {}}
    ends = time.monotonic() + 60 * options.minutes
    found = _known(options.json)
    found.setdefault("doctor", _doctor())
    found.setdefault("rows", {})
    for row in rows(options.devices, quick=options.quick):
        known = found["rows"].get(row.name)
        if known is not None and "failed" not in known:
            continue
        if time.monotonic() > ends:
            break
        if row.kind != "first" and row.device in _without_picture(found["rows"].values()):
            continue
        began = time.monotonic()
        found["rows"][row.name] = {**asdict(row), **_taken(row, options)}
        said = found["rows"][row.name].get("failed", "done")
        print(f"{time.monotonic() - began:6.1f} s  {row.name}: {said}", file=sys.stderr, flush=True)
        if options.json:
            _keep(options.json, found)
    return found


def _without_picture(taken: Iterable[Mapping[str, Any]]) -> set[str]:
    """Return the devices that did not render their first picture."""
    return {row["device"] for row in taken if row["kind"] == "first" and "failed" in row}


def _known(file: Path | None) -> dict[str, Any]:
    """Return what an earlier call has put into the file."""
    kept = json.loads(file.read_text()) if file and file.is_file() else {}
    return {key: value for key, value in kept.get("device", {}).items() if key != "machine"}


def _keep(file: Path, found: dict[str, Any]) -> None:
    from bench import keep  # here: it imports this file

    keep(file, "device", found)


def _taken(row: Row, options: argparse.Namespace) -> dict[str, Any]:
    """Run the row in a process of its own; return what it found, or why it failed."""
    words = [sys.argv[0], "device", "--row", json.dumps(asdict(row)), "--work", str(options.work)]
    words += ["--quick"] if options.quick else []
    patience = COMPILING_S if row.kind == "first" else PATIENCE_S
    try:
        done = subprocess.run([sys.executable, *words], capture_output=True, text=True, timeout=patience)
    except subprocess.TimeoutExpired:
        return {"failed": f"took more than {patience} s"}
    for line in reversed(done.stdout.splitlines()):
        if line.startswith('{"found"'):
            found: dict[str, Any] = json.loads(line)["found"]
            return found
    return {"failed": f"exit code {done.returncode}: {(done.stderr or done.stdout)[-1500:].strip()}"}


def _doctor() -> Any:
    """Return what `spin-usd doctor` says of this machine, and the driver's own words where there is one."""
    done = subprocess.run([*COMMAND, "doctor", "--json"], capture_output=True, text=True)
    query = ["nvidia-smi", "--query-gpu=name,driver_version,memory.total", "--format=csv,noheader"]
    try:
        driver = subprocess.run(query, capture_output=True, text=True).stdout.strip()
    except FileNotFoundError:
        driver = ""
    try:
        said = json.loads(done.stdout)
    except ValueError:
        said = done.stdout + done.stderr
    return {"doctor": said, "driver": driver}


def author(stage: str, width: int, work: Path) -> Path:
    """Author the stage in `work` unless it is there; return its root layer."""
    folder = work / f"{stage}{width or 'lens'}"
    root = folder / "dataset.usda"
    if root.is_file():
        return root
    camera = own_camera(work / "camera.json", width) if width else "speedplus"
    if stage == "two":
        asked("author", *TWO, "--camera", camera, "--out", folder)
    elif stage in ("run", "plain"):
        poses = ("--sample", f"range=4..9 inside=1 count={RUN['frames']}", "--seed", "1")
        asked("author", *poses, "--target", "tango", "--camera", camera, "--out", folder)
    else:
        three_stages.author(stage, folder, frames="0:4", camera=camera)
    return root


def first(row: Row, work: Path) -> dict[str, Any]:
    """Render the first picture of the device in a run of its own, for which a driver compiles kernels and keeps them;
    this may take minutes, and is lost if the run is killed."""
    out, began = _dataset(row, work), time.perf_counter()
    root = author(row.stage, row.width, work)
    asked("render", root, "--device", row.device, "--workers", 1, "--frames", "0:1", "--samples", 1, "--out", out)
    return {"wall_s": time.perf_counter() - began}


def pictures(row: Row, work: Path) -> dict[str, Any]:
    """Render the stage's first pictures at each quality, the first of them against the reference."""
    import numpy as np

    from spin_usd.accuracy.error import Reference, linear_error
    from spin_usd.commands.measure.worker import watch_memory
    from spin_usd.picture.make_picture import Stopwatch, render_in
    from spin_usd.processes.open_renderer import open_renderer
    from spin_usd.scene.derived.content_keys import RenderSettings
    from spin_usd.scene.derived.light_groups import in_unit_light
    from spin_usd.scene.effort import Effort
    from spin_usd.stage.read.stage_reader import StageReader

    root = author(row.stage, row.width, work)
    reader = StageReader(root)
    scenes = [reader.scene(frame) for frame in reader.frames][:3]
    began = time.perf_counter()
    renderer = open_renderer("blender", device=row.device)
    opened = time.perf_counter() - began

    def rendered(scene: Any, effort: Effort, seed: int) -> Any:
        light = in_unit_light(scene)
        settings = RenderSettings(renderer="blender", effort=effort, seed=seed)
        return render_in(light, renderer, settings, Stopwatch()).relit(light.gains)

    memory, idle = watch_memory(), _device_memory()
    began = time.perf_counter()
    rendered(scenes[0], Effort(samples=1), 0)
    first = time.perf_counter() - began
    file = root.parent / f"reference-{REFERENCE['samples']}.npz"
    reference = None
    if not file.is_file() and row.device == "cpu":
        effort = Effort(samples=REFERENCE["samples"], bounces=REFERENCE["bounces"])
        parts = [rendered(scenes[0], effort, 1000 + part).rgba for part in range(REFERENCE["parts"])]
        np.savez_compressed(file, parts=np.stack(parts))
    found: dict[str, Any] = {}
    if file.is_file():
        parts = np.load(file)["parts"]
        coverage = parts[..., 3].mean(0)
        target = coverage >= 0.5
        reference = Reference.of([part[target][:, :3] for part in parts])
        found["reference_error"] = reference.error_squared**0.5
    qualities = {}
    for quality, effort in QUALITIES.items():
        times = []
        for seed in range(1 if quality == "reference" else ROUNDS):
            for scene in scenes:
                began = time.perf_counter()
                rendered(scene, effort, seed)
                times.append(time.perf_counter() - began)
        each: dict[str, Any] = {"warm_s": sorted(times[1:])[len(times[1:]) // 2], "first_s": times[0]}
        if reference is not None:
            runs = [rendered(scenes[0], effort, seed) for seed in (11, 12)]
            error = linear_error(np.stack([run.rgb[target] for run in runs]), reference)
            each |= {
                "error": error.squared**0.5,
                "bias_squared": error.bias_squared,
                "brightness": error.brightness,
                "coverage_off": float(np.abs(runs[0].coverage - coverage).max()),
                "coverage_off_mean": float(np.abs(runs[0].coverage - coverage).mean()),
            }
        qualities[quality] = each
    return {
        "opened_s": opened,
        "first_s": first,
        "memory_bytes": memory(),
        "device_memory_mib": [idle, _device_memory()],
        "region": list(scenes[0].picture_region.shape),
        "versions": renderer.versions(),
        "qualities": qualities,
        **found,
    }


def _device_memory() -> int | None:
    """Return MiB in use on the first graphics processor, by all processes."""
    query = ["nvidia-smi", "--query-gpu=memory.used", "--format=csv,noheader,nounits"]
    try:
        return int(subprocess.run(query, capture_output=True, text=True).stdout.split()[0])
    except (FileNotFoundError, IndexError, ValueError):
        return None


def run(row: Row, work: Path) -> dict[str, Any]:
    """Run `spin-usd render` as a whole, with images, labels and files."""
    out, words = _dataset(row, work), _render(row, work)
    began = time.perf_counter()
    asked(*words, "--out", out)
    wall_s = time.perf_counter() - began
    return {"wall_s": wall_s, "per_picture_s": wall_s / RUN["frames"], "sums": _sums(out)}


def _dataset(row: Row, work: Path) -> Path:
    """Return the folder for a row's dataset, which is not there."""
    out = work / f"dataset-{row.device}-{row.workers}"
    shutil.rmtree(out, ignore_errors=True)
    return out


def _render(row: Row, work: Path) -> tuple[object, ...]:
    root = author("run", RUN["width"], work)
    return ("render", root, "--device", row.device, "--workers", row.workers, "--quality", RUN["quality"])


def _sums(out: Path) -> dict[str, str]:
    """Return by kind one sum of all of a dataset's files: equal sums, equal bytes."""
    sums = {}
    for kind in ("image", "depth", "segmentation", "dense_pose"):
        whole = hashlib.sha256()
        for file in sorted((out / kind).rglob("*.*")):
            whole.update(file.read_bytes())
        sums[kind] = whole.hexdigest()[:16]
    return sums


def refusal(row: Row, work: Path) -> dict[str, Any]:
    """Ask for pictures that the device cannot render; return what the command says."""
    words = ["render", author("matt", LENS, work), "--device", row.device, "--frames", "0:1", "--out", work / "refused"]
    done = subprocess.run([*COMMAND, *map(str, words)], capture_output=True, text=True)
    return {"exit_code": done.returncode, "said": done.stderr.strip()}


def kill(row: Row, work: Path) -> dict[str, Any]:
    """Kill a run on the device without warning, go on with it, and compare its files with those of a whole run."""
    whole, out = _dataset(row, work), work / "dataset-killed"
    asked(*_render(row, work), "--out", whole)
    process = subprocess.Popen([*COMMAND, *map(str, (*_render(row, work), "--out", out))], stdout=subprocess.DEVNULL)
    records = out / "records"
    while process.poll() is None and len(list(records.rglob("*.json"))) < RUN["frames"] // 4:
        time.sleep(0.05)
    process.kill()
    process.wait()
    kept = len(list(records.rglob("*.json")))
    began = time.perf_counter()
    asked(*_render(row, work), "--out", out)
    resumed = time.perf_counter() - began
    check = subprocess.run([*COMMAND, "check", str(out)], capture_output=True, text=True)
    ours, theirs = _sums(out), _sums(whole)
    return {
        "kept": kept,
        "resumed_s": resumed,
        "check_exit_code": check.returncode,
        "equal": {kind: ours[kind] == theirs[kind] for kind in ours},
    }


def denoiser(row: Row, work: Path) -> dict[str, Any]:
    """Time the denoiser of `draft` and `standard` on the CPU and on the device."""
    from spin_usd.processes.open_renderer import open_renderer
    from spin_usd.scene.derived.light_groups import in_unit_light
    from spin_usd.stage.read.stage_reader import StageReader

    reader = StageReader(author("matt", row.width, work))
    scenes = [in_unit_light(reader.scene(frame)).scene for frame in reader.frames][:3]
    renderer: Any = open_renderer("blender", device=row.device)
    found: dict[str, Any] = {}
    for where in ("CPU", "GPU"):
        renderer._denoiser._scene.render.compositor_denoise_device = where
        for quality in ("draft", "standard"):
            times, made = [], None
            for _, scene in product(range(ROUNDS), scenes):
                began = time.perf_counter()
                made = renderer.radiance(scene, QUALITIES[quality], seed=0)
                times.append(time.perf_counter() - began)
            found[f"{where} {quality}"] = {"warm_s": sorted(times[3:])[len(times[3:]) // 2], "first_s": times[0]}
            found[f"{where} {quality}"]["mean_light"] = float(made.groups.mean()) if made is not None else None
    return found


KINDS: Mapping[str, Any] = {
    "first": first,
    "pictures": pictures,
    "run": run,
    "denoiser": denoiser,
    "refusal": refusal,
    "kill": kill,
}


def table(figures: dict[str, Any]) -> str:
    """Return the figures as Markdown: of light a row for each stage, width and device, and one for each whole run."""
    taken = [row for row in figures["rows"].values() if "failed" not in row]
    pictures, runs = ([row for row in taken if row["kind"] == kind] for kind in ("pictures", "run"))
    pictures.sort(key=lambda row: (row["width"] == LENS, row["width"], row["stage"]))
    headings = ["stage", "region, px", "device", "first, s", *(f"{name}, s · error" for name in QUALITIES)]
    lines = [
        [
            f"{row['stage']}, {row['width'] or 'the lens of SPEED+'}",
            "x".join(map(str, reversed(row["region"]))),
            row["device"],
            number(row["first_s"]),
            *(_cost_and_error(row["qualities"][name]) for name in QUALITIES),
        ]
        for row in pictures
    ]
    whole = [[row["device"], str(row["workers"]), number(row["wall_s"])] for row in runs]
    failed = [f"\n{name}: {row['failed'][-200:]}" for name, row in figures["rows"].items() if "failed" in row]
    of_runs = in_markdown(["device", "workers", f"{RUN['frames']} pictures, s"], whole)
    return "\n".join([in_markdown(headings, lines), "", of_runs, *failed])


def _cost_and_error(quality: dict[str, Any]) -> str:
    error = f" · {percent(quality['error'])}" if "error" in quality else ""
    return f"{number(quality['warm_s'])}{error}"

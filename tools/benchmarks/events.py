"""Events of light that is taken from few renders, beside events of renders of every step: how many differ, and what
both cost.

A craft tumbles before the Earth, or before nothing under a lamp; both ways have the same steps, renderer and samples.
Events differ where a pixel has more or fewer of a sign; so they do between renders of every step by two seeds.
"""

import argparse
import tempfile
import time
from functools import partial
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.frames import own_camera
from numpy.typing import NDArray

import spin_usd
from spin_usd.basics.progress import no_progress
from spin_usd.events.event_stage import EventStage
from spin_usd.events.light_frames import LightFrames, rendered
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.processes.open_renderer import open_renderer
from spin_usd.processes.processors import hold_to, usable_cpus
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.sensor.events import EventMaker

CHUNK = 32
SCENARIO = """epoch = "2026-03-20T10:05:00Z"
duration_s = 60
step_s = 1
stars = -3
[target.orbit]
kind = "keplerian"
semi_major_axis_m = 7_078_137
inclination_deg = 98.2
mean_anomaly_deg = 52
[target.attitude]
kind = "tumbling"
q = [0.8, 0.36, 0.48, 0]
rate_deg_s = [{0}, {1}, {2}]
inertia_kg_m2 = [20, 30, 40]
[chaser.orbit]
kind = "relative_state"
place_m = {3}
velocity_m_s = [0, 0, 0]
"""
PLACES = {"lamp": "[0, -8, 0]", "Earth": "[6, -5, 0]"}  # metres, radially, along the way and across it
AXIS = (0.6, 0.69, -0.4)  # about which it turns at first


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--widths", type=int, nargs="+", default=[640], metavar="PIXELS")
    parser.add_argument("--rates", type=float, nargs="+", default=[1.0, 5.0], metavar="DEGREES", help="a second")
    parser.add_argument("--seconds", type=float, default=2.0, help="of the scene")
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--renderer", default="blender")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """Author each stage, and make its events in both ways on one processor."""
    if options.quick:
        options.widths, options.rates, options.seconds, options.samples = [64], [5.0], 1.0, 1
        options.renderer = "raycast"
    hold_to(usable_cpus()[:1])
    rows = []
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as name:
        for width in options.widths:
            camera = own_camera(Path(name, f"camera{width}.json"), width)
            for rate in options.rates:
                for behind in ("lamp", "Earth"):
                    stage = author(Path(name, f"{behind}{width}_{rate:g}"), camera, rate, behind)
                    rows.append({"width": width, "rate": rate, "behind": behind, **compared(stage, options)})
    return {"samples": options.samples, "renderer": options.renderer, "rows": rows}


def author(folder: Path, camera: str, rate: float, behind: str) -> Path:
    """Author the stage of a craft that turns by so many degrees a second; return its root layer."""
    folder.mkdir()
    rates = (rate * each for each in AXIS)
    (folder / "scenario.toml").write_text(SCENARIO.format(*rates, PLACES[behind]))
    made = spin_usd.author(
        scenario=folder / "scenario.toml",
        target="tango",
        camera=camera,
        frames="0:61",
        event_sensor="v2e_clean",
        out=folder / "stage",
        environment="deep_space" if behind == "lamp" else None,
    )
    return Path(made.root)


def compared(stage: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Make the events of a stage in both ways, and compare them."""
    seen = EventStage(stage, variant="nominal", pictures=range(ceil(options.seconds) + 1))
    at = partial(seen.scene, no_progress)
    caster = EmbreeCaster()
    maker = PassMaker(caster, open_renderer(options.renderer, caster=caster))
    began = time.process_time()
    times = [each for each in seen.times(no_progress) if each <= options.seconds]
    steps_s = time.process_time() - began
    found: dict[str, Any] = {"steps": len(times)}
    counts = []
    for way, seed in (("few", 0), ("every", 0), ("other_seed", 1)):
        settings = RenderSettings(renderer=options.renderer, effort=Effort(samples=options.samples), seed=seed)
        began, renders, events_s = time.process_time(), 0, 0.0
        pixels: EventMaker | None = None
        events: list[NDArray[np.void]] = []
        for start in range(0, len(times) - 1, CHUNK):
            part = LightFrames(
                at,
                times[start : start + CHUNK + 1],
                maker,
                partial(rendered, maker=maker, settings=settings),
                settings,
                seen.sensor,
                every_step=way != "few",
            )
            for frame in part.frames():
                before = time.process_time()
                pixels = pixels or EventMaker(seen.sensor, frame.light.shape, seed=0)
                if not events or frame.seconds > times[start]:
                    events.append(pixels.events(frame.light, frame.seconds))
                events_s += time.process_time() - before
            renders += part.rendered
        all_events = np.concatenate(events)
        rows, columns = frame.light.shape
        place = (all_events["y"].astype(int) * columns + all_events["x"]) * 2 + all_events["p"]
        counts.append(np.bincount(place, minlength=2 * rows * columns))
        spent = time.process_time() - began + (steps_s if way == "few" else 0)
        length = times[-1] - times[0]
        found |= {f"{way}_renders": renders, f"{way}_s": spent / length, f"{way}_events": len(all_events)}
        found["pixels_s"] = events_s / length
    few, every, other = counts
    for name, these in (("differ", few), ("seeds_differ", other)):
        found[name] = float(np.abs(these - every).sum() / max(every.sum(), 1))
    return found


def table(report: dict[str, Any]) -> str:
    """Return the rows as Markdown."""
    heads = "width", "degrees/s", "behind", "steps", "renders", "events", "differ", "two seeds", "s a second", "pixels"
    lines = ["| " + " | ".join(heads) + " | every step |", "| ---: | ---: | --- " + "| ---: " * 8 + "|"]
    for row in report["rows"]:
        made = f"{row['steps']} | {row['few_renders']} | {row['few_events']:,} | {row['differ']:.1%}"
        costs = f"{row['seeds_differ']:.1%} | {row['few_s']:.1f} | {row['pixels_s']:.1f} | {row['every_s']:.1f}"
        lines.append(f"| {row['width']} | {row['rate']:g} | {row['behind']} | {made} | {costs} |")
    return "\n".join(lines)

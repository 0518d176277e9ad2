"""What optics, detector and PNG cost for a 1920 x 1200 grey picture on one core, beside a plain SciPy implementation.

The plain one convolves with the same kernels by SciPy's Gaussian filter and FFT, draws NumPy's Poisson numbers, and
writes the PNG with Pillow.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter
from scipy.signal import fftconvolve

from spin_usd.formats.image_file import write_image
from spin_usd.geometry.camera import Camera
from spin_usd.processes.processors import hold_to, usable_cpus
from spin_usd.scene.sensor import Optics, Sensor
from spin_usd.sensor.detector import detect
from spin_usd.sensor.develop import through_optics
from spin_usd.sensor.tone import encode

WIDTH, HEIGHT = 1920, 1200
CAMERA = Camera(width=WIDTH, height=HEIGHT, fx=2988, fy=2988, cx=960, cy=600)
OPTICS = Optics(psf_sigma=0.8, glare=0.05)
SENSOR = Sensor(gain=6, full_well=24_000, read_noise=12, dark_current=100, prnu=0.01, adc_bits=12, black_level=50)
CENTRE = np.array([[[HEIGHT - 1]], [[WIDTH - 1]]], np.float32)  # of a halo that reaches over the whole picture
Step = tuple[str, Callable[[], object]]


def scenes() -> dict[str, NDArray[np.float32]]:
    """Return a target of 12 % of the frame before black sky, and mid-grey everywhere."""
    y, x = np.indices((HEIGHT, WIDTH), np.float32)
    shade = 0.5 + 0.4 * np.sin(x / 37) * np.sin(y / 23)
    target = np.where(np.hypot((x - 960) / 370, (y - 600) / 240) < 1, shade, 0).astype(np.float32)
    return {"target before black": target, "grey": np.full((HEIGHT, WIDTH), 0.5, np.float32)}


def ours(light: NDArray[np.float32], file: Path) -> list[Step]:
    through = through_optics(light[..., None], OPTICS, CAMERA, exposure=1.0)
    image = detect(through, SENSOR, seed=1)
    return [
        ("optics", lambda: through_optics(light[..., None], OPTICS, CAMERA, exposure=1.0)),
        ("detector", lambda: detect(through, SENSOR, seed=1)),
        ("PNG", lambda: write_image(file, image, channels=("Y",))),
    ]


def plain(light: NDArray[np.float32], file: Path) -> list[Step]:
    y, x = np.indices((2 * HEIGHT - 1, 2 * WIDTH - 1), np.float32) - CENTRE
    core, falloff = OPTICS.glare_core, OPTICS.glare_falloff
    halo = (1 + (x * x + y * y) / core**2) ** (-falloff / 2) * (falloff - 2) / (2 * np.pi * core**2)
    pattern = 1 + SENSOR.prnu * np.random.default_rng(0).standard_normal(light.shape, np.float32)

    def optics() -> NDArray[np.floating]:
        core = gaussian_filter(light, OPTICS.psf_sigma, mode="constant")
        return (1 - OPTICS.glare) * core + OPTICS.glare * fftconvolve(core, halo, "same")[:HEIGHT, :WIDTH]

    def detector() -> NDArray[np.uint8]:
        chance, full_scale = np.random.default_rng(1), 2**SENSOR.adc_bits - 1
        expected = through * pattern * SENSOR.gain * full_scale + SENSOR.dark_current * SENSOR.time
        electrons = np.minimum(chance.poisson(np.maximum(expected, 0)), SENSOR.full_well)
        electrons = electrons + chance.normal(0, SENSOR.read_noise, light.shape)
        steps = np.clip(np.rint(electrons / SENSOR.gain + SENSOR.black_level), 0, full_scale)
        return np.rint(encode(steps / full_scale, "srgb") * 255).astype(np.uint8)

    through = optics()
    image = detector()
    return [
        ("optics", optics),
        ("detector", detector),
        ("PNG", lambda: Image.fromarray(image).save(file)),
    ]


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=int, default=9)


def measure(options: argparse.Namespace) -> dict[str, Any]:
    rounds = 1 if options.quick else options.rounds
    hold_to(usable_cpus()[:1])
    steps = []
    with tempfile.TemporaryDirectory() as folder:
        for name, light in scenes().items():
            for who, make in (("spin_usd", ours), ("plain", plain)):
                for step, work in make(light, Path(folder) / "a.png"):
                    wall, cpu = timed(work, rounds if who == "spin_usd" else min(rounds, 3))
                    steps.append({"scene": name, "who": who, "step": step, "wall_s": wall, "cpu_s": cpu})
    return {"rounds": rounds, "steps": steps}


def table(figures: dict[str, Any]) -> str:
    """Return seconds of wall clock (of processor), medians."""
    lines = [f"| of {figures['rounds']} rounds | by | step | seconds (processor) |", "| --- | --- | --- | --- |"]
    for (name, who), steps in groupby(figures["steps"], key=lambda step: (step["scene"], step["who"])):
        listed = list(steps)
        total = {kind: sum(step[kind] for step in listed) for kind in ("wall_s", "cpu_s")}
        for step in (*listed, {"step": "in all", **total}):
            lines.append(f"| {name} | {who} | {step['step']} | {step['wall_s']:.3f} ({step['cpu_s']:.3f}) |")
    return "\n".join(lines)


def timed(work: Callable[[], object], rounds: int) -> tuple[float, float]:
    """Return median wall-clock and processor seconds."""
    wall, processor = [], []
    for _ in range(rounds):
        began = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - began[0])
        processor.append(time.process_time() - began[1])
    return statistics.median(wall), statistics.median(processor)

"""Measure whether the memory of a supervisor and of a worker grows with the pictures that they make.

    tools/try_memory [--frames N] [--variants N] [--renderer NAME] [--csv FILE] [--json FILE] [--plot FILE]

One worker makes N small frames in each of N variants, each with a Sun of its own, variant after variant. What both hold
(resident set) goes into the CSV file as pictures are finished; the JSON file keeps slopes by renderer, and the CSV of
each, from which the plot is drawn. tools/build_docs writes the slopes into docs/concepts/benchmarks.md.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import psutil
from matplotlib.figure import Figure
from PIL import Image
from trials import SupervisedRun, author, records

SHOWN = 40  # samples of a renderer, in the JSON file
LOOK_S = 0.5
WARM = 0.25  # of the pictures: what is kept for later ones has been filled by then
MB = 1e6


@dataclass(frozen=True, kw_only=True)
class MemorySample:
    """What was held when so many pictures were finished, in MB: by the supervisor, and by its worker (resident set)."""

    pictures: int
    supervisor: float
    worker: float


def sampled(run: SupervisedRun, dataset: Path) -> list[MemorySample]:
    """Return samples of a run with one worker, from its first picture on, until it has ended."""
    found: list[MemorySample] = []
    while run.goes_on:
        pictures, children = records(dataset), run.children()
        if pictures and len(children) == 1 and (not found or found[-1].pictures < pictures):
            with suppress(psutil.Error):
                supervisor = psutil.Process(run.process.pid)
                held = {"supervisor": _held(supervisor), "worker": _held(children[0])}
                if all(held.values()):  # a process that has ended holds nothing
                    found.append(MemorySample(pictures=pictures, **held))
        time.sleep(LOOK_S)
    return found


def _held(process: psutil.Process) -> float:
    return float(process.memory_info().rss / MB)


def slope(samples: Sequence[MemorySample], of: str) -> float:
    """Return MB for 1,000 pictures more: the line of least squares through the samples but the first WARM of them."""
    warm = [sample for sample in samples if sample.pictures >= WARM * samples[-1].pictures]
    line = np.polyfit([sample.pictures for sample in warm], [getattr(sample, of) for sample in warm], 1)
    return float(1000 * line[0])


def in_csv(samples: Sequence[MemorySample]) -> str:
    rows = (f"{sample.pictures},{sample.supervisor:.1f},{sample.worker:.1f}" for sample in samples)
    return "\n".join(["pictures,supervisor_MB,worker_MB", *rows, ""])


def main() -> None:
    options = _options()
    with tempfile.TemporaryDirectory(prefix="spin-usd-memory-") as folder:
        stage, dataset = author(Path(folder) / "authored", options.frames, options.variants), Path(folder) / "dataset"
        how = ("--renderer", options.renderer, "--samples", 1, "--workers", 1, "--variants", "all")
        run = SupervisedRun("render", stage, "--out", dataset, *how)
        samples = sampled(run, dataset)
        if run.wait():
            sys.exit(run.said())
    if options.csv:
        options.csv.write_text(in_csv(samples))
    figures = _kept(options, samples)
    if options.plot:
        _plot(figures, options.plot)
    print(json.dumps({name: figures[options.renderer][name] for name in ("pictures", "slopes")}))


def _kept(options: argparse.Namespace, samples: list[MemorySample]) -> dict[str, Any]:
    """Return all figures that are known, with these; put them into the JSON file, if there is one."""
    known: dict[str, Any] = {}
    if options.json and options.json.is_file():
        known = json.loads(options.json.read_text())
    thin = samples[:: max(1, len(samples) // SHOWN)]
    known[options.renderer] = {
        "pictures": options.frames * options.variants,
        "variants": options.variants,
        "slopes": {of: round(slope(samples, of), 2) for of in ("supervisor", "worker")},
        "samples": [{name: round(value, 1) for name, value in asdict(sample).items()} for sample in thin],
    }
    if options.json:
        options.json.write_text(json.dumps(dict(sorted(known.items()))) + "\n")
    return known


def _plot(figures: dict[str, Any], file: Path) -> None:
    """Draw what each process held."""
    mpl.rcParams["font.size"] = 8
    figure = Figure(figsize=(5, 2.2), layout="constrained")
    axes = figure.subplots()
    for renderer, of_one in figures.items():
        for process, line in (("worker", "-"), ("supervisor", ":")):
            pictures = [sample["pictures"] for sample in of_one["samples"]]
            held = [sample[process] for sample in of_one["samples"]]
            axes.plot(pictures, held, line, linewidth=1, label=f"{process}, {renderer}")
    axes.set(xlabel="pictures finished", ylabel="MB held", xlim=(0, None), ylim=(0, None))
    axes.legend(loc="upper right")
    with BytesIO() as png:
        figure.savefig(png, dpi=100)
        Image.open(png).convert("RGB").quantize(16).save(file, optimize=True)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=10)
    parser.add_argument("--variants", type=int, default=2)
    parser.add_argument("--renderer", default="raycast")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="every sample")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also put the figures into this file")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw those of all renderers in the JSON file")
    return parser.parse_args()


if __name__ == "__main__":
    main()

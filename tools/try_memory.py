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
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from PIL import Image
from run_trials.memory import MemorySample, in_csv, sampled, slope
from run_trials.small_stage import author
from run_trials.supervised_run import SupervisedRun

SHOWN = 40  # samples of a renderer, in the JSON file


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
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    main()

"""What many augmentations of the same pictures cost beside one of them, measured and as `plan` predicts it.

For each specification and number of samples: a dataset of the first augmentation, one of all of them, and the first
again, in turn, each in a fresh folder from the command line as a user has it; planning and the start of Blender count.
"""

import argparse
import shutil
import statistics
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.command import asked

from spin_usd import resources

COUNTS = ("made", "label_passes", "renders")  # of a render's report: pictures exposed, label passes and renders made


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=Path, default=resources.stages() / "examples" / "tango_speedplus_poses.json")
    parser.add_argument("--frames", default="0:20", metavar="A:B:STEP", help="of the pose list")
    parser.add_argument("--target", default="tango")
    parser.add_argument("--units-per-metre", type=float)
    parser.add_argument("--camera", default="speedplus")
    parser.add_argument("--specs", nargs="+", default=["relight", "isda"], metavar="NAME_OR_FILE")
    parser.add_argument("--samples", nargs="+", type=int, default=[16, 64], metavar="N")
    parser.add_argument("--rounds", type=int, default=1, help="of the first, all, and the first again")
    parser.add_argument("--workers", type=int, help="as many as fit if not given")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.frames, options.specs, options.samples, options.rounds = "0:1", ["relight"], [1], 1
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as folder:
        cases = [case for spec in options.specs for case in of_spec(spec, options, Path(folder) / Path(spec).stem)]
    return {"cases": cases}


def of_spec(spec: str, options: argparse.Namespace, folder: Path) -> Iterator[dict[str, Any]]:
    """Author the stage with the augmentations of `spec`; one case for each number of samples."""
    stage, names = augmented(spec, options, folder)
    workers = ["--workers", options.workers] if options.workers else []
    for samples in options.samples:
        of = {
            what: [stage, "--effort", f"samples={samples}", "--variants", ",".join(variants)]
            for what, variants in (("one", names[:1]), ("all", names))
        }
        case: dict[str, Any] = {"spec": Path(spec).stem, "augmentations": len(names), "samples": samples}
        case["planned"] = {what: asked("plan", *arguments)["wall_seconds"] for what, arguments in of.items()}
        case |= {"one": [], "all": []}
        for what in ("one", "all", "one") * options.rounds:
            case[what].append(asked("render", *of[what], *workers, "--out", folder / "dataset"))
            shutil.rmtree(folder / "dataset")
        yield case


def augmented(spec: str, options: argparse.Namespace, folder: Path) -> tuple[Path, list[str]]:
    """Return the stage's root layer, and its augmentations."""
    poses, units = ["--poses", options.poses, "--frames", options.frames], options.units_per_metre
    model = ["--target", options.target, *(["--units-per-metre", units] if units else []), "--camera", options.camera]
    stage = Path(asked("author", *poses, *model, "--out", folder / "stage")["root"])
    return stage, asked("augment", stage, "--spec", spec)["augmentations"]


def table(figures: dict[str, Any]) -> str:
    """Return the figures as Markdown. Seconds are medians of all rounds; work is over all workers, without their start.

    What is planned is for as many workers as fit.
    """
    lines = [
        "| augmentations | samples | one, s | all, s | all / one | work, all / one | planned, s | planned, all / one | "
        "pictures | label passes | renders |",
        "| --- " * 11 + "|",
    ]
    for case in figures["cases"]:
        one, every, plan = case["one"], case["all"], case["planned"]
        seconds = [statistics.median(run["seconds"] for run in runs) for runs in (one, every)]
        work = [statistics.median(sum(run["work"].values()) for run in runs) for runs in (one, every)]
        counts = " | ".join(f"{every[0][name]} (one: {one[0][name]})" for name in COUNTS)
        lines.append(
            f"| {case['augmentations']} of {case['spec']} | {case['samples']} | {seconds[0]:.1f} | "
            f"{seconds[1]:.1f} | {seconds[1] / seconds[0]:.2f} | {work[1] / work[0]:.2f} | "
            f"{plan['one']:.1f}, {plan['all']:.1f} | {plan['all'] / plan['one']:.2f} | {counts} |"
        )
    return "\n".join(lines)

"""What many augmentations of the same pictures cost beside one of them, measured and as `plan` predicts it.

For each specification and number of samples: a dataset of the first augmentation, one of all of them, and the first
again, in turn, each in a fresh folder from the command line as a user has it; planning and the start of Blender count.
"""

import argparse
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from spin_usd import resources

COUNTS = ("made", "label_passes", "renders")  # of a render's report: pictures exposed, label passes and renders made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--poses", type=Path, default=resources.stages() / "examples" / "tango_speedplus_poses.json")
    parser.add_argument("--frames", default="0:20", metavar="A:B:STEP", help="of the pose list")
    parser.add_argument("--target", default="tango")
    parser.add_argument("--units-per-metre", type=float)
    parser.add_argument("--camera", default="speedplus")
    parser.add_argument("--specs", nargs="+", default=["relight", "isda"], metavar="NAME_OR_FILE")
    parser.add_argument("--samples", nargs="+", type=int, default=[16, 64], metavar="N")
    parser.add_argument("--rounds", type=int, default=1, help="of the first, all, and the first again")
    parser.add_argument("--workers", type=int, help="as many as fit if not given")
    parser.add_argument("--json", type=Path, help="also write the figures here")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as folder:
        figures = [
            figure for spec in options.specs for figure in measure(spec, options, Path(folder) / Path(spec).stem)
        ]
    print(table(figures))
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n")


def measure(spec: str, options: argparse.Namespace, folder: Path) -> Iterator[dict[str, Any]]:
    """Author the stage with the augmentations of `spec`; one figure for each number of samples."""
    stage, names = augmented(spec, options, folder)
    workers = ["--workers", options.workers] if options.workers else []
    for samples in options.samples:
        of = {
            what: [stage, "--samples", samples, "--variants", ",".join(variants)]
            for what, variants in (("one", names[:1]), ("all", names))
        }
        figure: dict[str, Any] = {"spec": Path(spec).stem, "augmentations": len(names), "samples": samples}
        figure["planned"] = {what: asked("plan", *arguments)["wall_seconds"] for what, arguments in of.items()}
        figure |= {"one": [], "all": []}
        for what in ("one", "all", "one") * options.rounds:
            figure[what].append(rendered([*of[what], *workers], folder / "dataset"))
        yield figure


def augmented(spec: str, options: argparse.Namespace, folder: Path) -> tuple[Path, list[str]]:
    """The stage's root layer, and its augmentations."""
    poses, units = ["--poses", options.poses, "--frames", options.frames], options.units_per_metre
    model = ["--target", options.target, *(["--units-per-metre", units] if units else []), "--camera", options.camera]
    stage = Path(asked("author", *poses, *model, "--out", folder / "stage")["root"])
    return stage, asked("augment", stage, "--spec", spec)["augmentations"]


def rendered(arguments: Sequence[object], out: Path) -> dict[str, Any]:
    """The report of a render into a fresh folder, which is removed again."""
    report = asked("render", *arguments, "--out", out)
    shutil.rmtree(out)
    return report


def asked(*arguments: object) -> dict[str, Any]:
    """What a command of spin-usd answers to programs."""
    command = [sys.executable, "-m", "spin_usd.cli.main", "--quiet", *map(str, arguments), "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, arguments))} ended with exit code {done.returncode}")
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def table(figures: Sequence[dict[str, Any]]) -> str:
    """The figures as Markdown. Seconds are medians of all rounds; work is over all workers, without their start.

    What is planned is for as many workers as fit.
    """
    lines = [
        "| augmentations | samples | one, s | all, s | all / one | work, all / one | planned, s | planned, all / one | "
        "pictures | label passes | renders |",
        "| --- " * 11 + "|",
    ]
    for figure in figures:
        one, every, plan = figure["one"], figure["all"], figure["planned"]
        seconds = [statistics.median(run["seconds"] for run in runs) for runs in (one, every)]
        work = [statistics.median(sum(run["work"].values()) for run in runs) for runs in (one, every)]
        counts = " | ".join(f"{every[0][name]} (one: {one[0][name]})" for name in COUNTS)
        lines.append(
            f"| {figure['augmentations']} of {figure['spec']} | {figure['samples']} | {seconds[0]:.1f} | "
            f"{seconds[1]:.1f} | {seconds[1] / seconds[0]:.2f} | {work[1] / work[0]:.2f} | "
            f"{plan['one']:.1f}, {plan['all']:.1f} | {plan['all'] / plan['one']:.2f} | {counts} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    main()

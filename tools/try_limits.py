"""Render on full and read-only disks, beside another run, and under limits of memory, files and their size.

    tools/try_limits [--full-disks N] [--times N] [--pictures N] [--out DIR]

Each run ends with exit code 0, 1 or 2 and a sentence, without a traceback; leaves no process, no temporary file, and no
record of a file that is not whole; and the same command without the trouble completes the dataset, to the byte as an
undisturbed one. Full and read-only disks are small ones in memory (tmpfs), which only root can mount; others have the
rest tried. Exit code 1: something did not hold.
"""

import argparse
import random
import sys
import tempfile
from pathlib import Path

from run_trials.limits import LimitTrial, can_mount
from run_trials.small_stage import author


def main() -> int:
    options = _options()
    with tempfile.TemporaryDirectory(prefix="spin-usd-limits-") as folder:
        out = options.out or Path(folder)
        trial = LimitTrial(
            stage=author(out / "authored", options.pictures),
            out=out,
            pictures=options.pictures,
            how=("--renderer", "raycast", "--samples", 1, "--workers", options.workers),
            chance=random.Random(options.seed),
        )
        trial.make_whole()
        if can_mount() and options.full_disks:
            trial.full_disk(options.full_disks)
            trial.read_only()
        trial.two_at_once(options.times)
        trial.all_limits(options.times)
    print(trial.table())
    return int(bool(trial.faults))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=int, default=8)
    parser.add_argument("--full-disks", type=int, default=3, help="how often a disk is full, at a random place")
    parser.add_argument("--times", type=int, default=1, help="how often the others are tried")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, metavar="DIR", help="an empty folder, in which all datasets are kept")
    return parser.parse_args()


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    sys.exit(main())

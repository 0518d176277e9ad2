"""Render many small pictures while children are killed at random, then supervisors, then workers are stopped.

    tools/try_kills [--pictures N] [--kills K] [--supervisor-kills K] [--stops K] [--every S] [--out DIR]

A run ends by itself, with exit code 0, however often its planning and rendering children get SIGKILL; one whose
supervisor gets it leaves no process, and the same command takes up where it stopped. Each dataset must be to the byte
as an undisturbed one, with every sha256 right and no temporary file left. A run that ends before it was killed often
enough is followed by another. A worker that gets SIGSTOP is timed until it is ended. Exit code 1: something did not
hold.
"""

import argparse
import random
import sys
import tempfile
from pathlib import Path

from run_trials.kills import KillTrial
from run_trials.small_stage import author


def main() -> int:
    options = _options()
    with tempfile.TemporaryDirectory(prefix="spin-usd-kills-") as folder:
        out = options.out or Path(folder)
        trial = KillTrial(
            stage=author(out / "authored", options.pictures),
            out=out,
            pictures=options.pictures,
            how=("--renderer", options.renderer, "--samples", options.samples, "--workers", options.workers),
            every_s=options.every,
            chance=random.Random(options.seed),
        )
        trial.make_whole()
        trial.kill_children(options.kills)
        trial.kill_supervisors(options.supervisor_kills)
        trial.stop_workers(options.stops, options.picture_timeout)
    print(trial.table())
    return int(bool(trial.faults))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=int, default=30)
    parser.add_argument("--kills", type=int, default=5, help="of children, at least")
    parser.add_argument("--supervisor-kills", type=int, default=2)
    parser.add_argument("--stops", type=int, default=0, help="of workers, by SIGSTOP")
    parser.add_argument("--picture-timeout", type=float, metavar="S", help="of the runs whose workers are stopped")
    parser.add_argument("--every", type=float, default=1.0, metavar="S", help="seconds between kills, on average")
    parser.add_argument("--renderer", default="raycast")
    parser.add_argument("--samples", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, metavar="DIR", help="an empty folder, in which all datasets are kept")
    return parser.parse_args()


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    sys.exit(main())

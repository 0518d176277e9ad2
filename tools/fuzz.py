"""Give spin-usd hostile inputs, and tell what came of them in a table.

    tools/fuzz [--minutes M] [--seed S] [--keep DIR] [--only NAME]

The corpus is made by hand: paths, links, pipes and devices, cycles, bombs, numbers, indices, counts, nesting, names,
encodings, limits, signals. Then come mutants of every format that is read, until the time is over. An input keeps the
promises of SECURITY.md when each of its commands ends within 20 s with exit code 0, 1 or 2 and without a traceback,
touches nothing outside its folder, loses nothing of the user's, and leaves nothing behind. What does not is kept in
DIR, with the command that repeats it; --only with its name tries it again. Exit code 1: some did not.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

from fuzzing.campaign import Campaign
from fuzzing.corpus.corpus import corpus
from fuzzing.mutation.mutants import mutant_named
from fuzzing.table import table


def main() -> int:
    options = _options()
    with tempfile.TemporaryDirectory(prefix="spin-usd-fuzz-") as folder:
        campaign = Campaign(Path(folder).resolve(), keep=options.keep, seed=options.seed, workers=options.workers)
        if options.only:
            trials = [trial for trial in corpus() if trial.title.startswith(options.only)]
            mutant = mutant_named(options.only, options.seed)
            campaign.try_all([*trials, *([mutant] if mutant else [])], verbose=True)
        else:
            campaign.run(options.minutes)
    print(table(campaign.results))
    return int(campaign.failed)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0, help="how long; the corpus takes half of it at most")
    parser.add_argument("--seed", type=int, default=0, help="another seed, other mutants")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="where inputs that fail are kept")
    parser.add_argument("--only", metavar="NAME", help="a class, such as links, or one input, such as usda/17")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="how many inputs are tried at once")
    return parser.parse_args()


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    sys.exit(main())

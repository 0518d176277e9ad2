"""Give spin-usd hostile inputs, and tell what came of them in a table.

    tools/fuzz [--minutes M | --corpus | --mutants N] [--seed S] [--log FILE] [--keep DIR]
    tools/fuzz --only NAME [--seed S]

The corpus is made by hand: paths, links, pipes and devices, cycles, bombs, numbers, indices, counts, nesting, names,
encodings, limits, signals. Mutants are of every format that is read. An input keeps the promises of SECURITY.md when
each of its commands ends within 20 s with exit code 0, 1 or 2 and without a traceback, touches nothing outside its
folder, loses nothing of the user's, and leaves nothing behind. What does not is kept in DIR, with the command that
repeats it; --only with its name tries it again. Each verdict is a line of FILE: a campaign that was stopped goes on
there, and tries again what failed. Exit code 1: some did not keep the promises.
"""

import argparse
import os
import signal
import sys
import tempfile
from contextlib import suppress
from itertools import islice
from pathlib import Path

from fuzzing.campaign import Campaign
from fuzzing.corpus.corpus import corpus
from fuzzing.log import Log
from fuzzing.mutation.mutants import mutant_named, mutants
from fuzzing.table import table


def main() -> int:
    options = _options()
    log = Log(options.log, options.seed) if options.log else None
    with tempfile.TemporaryDirectory(prefix="spin-usd-fuzz-") as folder:
        at = Path(folder).resolve()
        campaign = Campaign(at, keep=options.keep, seed=options.seed, workers=options.workers, log=log)
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        with suppress(KeyboardInterrupt):  # what was tried is told
            _try(campaign, options)
    print(f"Seed {options.seed}.\n\n{table(campaign.results)}")
    return int(campaign.failed)


def _try(campaign: Campaign, options: argparse.Namespace) -> None:
    if options.only:
        mutant = mutant_named(options.only, options.seed)
        trials = [trial for trial in corpus() if trial.title.startswith(options.only)]
        campaign.try_all([*trials, *([mutant] if mutant else [])], verbose=True)
    elif options.corpus or options.mutants:
        campaign.try_all(sorted(corpus(), key=lambda trial: trial.alone) if options.corpus else [])
        campaign.try_all(islice(mutants(options.seed), options.mutants))
    else:
        campaign.run(options.minutes)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0, help="how long; the corpus takes half of it at most")
    parser.add_argument("--corpus", action="store_true", help="all of the corpus, however long it takes")
    parser.add_argument("--mutants", type=int, default=0, metavar="N", help="so many mutants, however long they take")
    parser.add_argument("--seed", type=int, default=0, help="another seed, other mutants")
    parser.add_argument("--log", type=Path, metavar="FILE", help="verdicts, from which a stopped campaign goes on")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="where inputs that fail are kept")
    parser.add_argument("--only", metavar="NAME", help="a class, such as links, or one input, such as usda/17")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="how many inputs are tried at once")
    return parser.parse_args()


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    sys.exit(main())

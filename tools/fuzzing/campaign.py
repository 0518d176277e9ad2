"""Try the corpus and mutants side by side, count what came of them, and keep what fails."""

import json
import random
import shutil
import sys
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import Queue

from fuzzing.attempt import attempt
from fuzzing.corpus.corpus import corpus
from fuzzing.log import Log
from fuzzing.mutation.mutants import mutants
from fuzzing.results import Judged, Results
from fuzzing.running.warm import WarmRunner
from fuzzing.sandbox import remove
from fuzzing.seeds import make_seeds
from fuzzing.trial import Outcome, Trial

CORPUS_SHARE = 0.5
MINUTE_S = 60.0


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where one input after another is tried: a folder, and a warm process."""

    folder: Path
    warm: WarmRunner


class Campaign:
    """Inputs tried in `folder`; `workers` at once. What `log` says was tried and kept the promises is not tried
    again."""

    def __init__(self, folder: Path, *, keep: Path | None, seed: int, workers: int, log: Log | None = None) -> None:
        self.results, self.failed, self._log = log.results() if log else Results(), False, log
        self._folder, self._keep, self._seed = folder, keep and keep.resolve(), seed
        self._seeds = folder / "seeds" / "work"
        self._places: Queue[Place] = Queue()
        places = [Place(folder=folder / str(n), warm=WarmRunner(folder / f"home{n}")) for n in range(workers)]
        make_seeds(self._seeds, places[0].warm)
        for place in places:
            self._places.put(place)
        self._count = workers

    def run(self, minutes: float) -> None:
        """Try the corpus in an order by the seed, then mutants, until the time is over."""
        began = time.monotonic()
        trials = list(corpus())
        random.Random(self._seed).shuffle(trials)
        self.try_all(_until(trials, began + minutes * CORPUS_SHARE * MINUTE_S))
        self.try_all(_until(mutants(self._seed), began + minutes * MINUTE_S))

    def try_all(self, trials: Iterable[Trial], *, verbose: bool = False) -> None:
        """Try them all, some at once."""
        waiting: set[Future[tuple[Trial, Outcome]]] = set()
        with ThreadPoolExecutor(self._count) as pool:
            for trial in (each for each in trials if not self.results.held(each.title)):
                waiting.add(pool.submit(self._tried, trial))
                if len(waiting) >= self._count:
                    waiting = self._counted(waiting, verbose)
            while waiting:
                waiting = self._counted(waiting, verbose)
        self._close()

    def _counted(
        self, waiting: set[Future[tuple[Trial, Outcome]]], verbose: bool
    ) -> set[Future[tuple[Trial, Outcome]]]:
        done, still = wait(waiting, return_when=FIRST_COMPLETED)
        for trial, outcome in (each.result() for each in done):
            judged = Judged(kind=trial.kind, verdict=outcome.verdict, seconds=outcome.seconds)
            self.results.add(trial.title, judged)
            if self._log:
                self._log.add(trial, outcome)
            if verbose or not outcome.verdict.keeps_the_promise:
                print(f"{trial.title}: {outcome.verdict}: {outcome.why!r}", file=sys.stderr, flush=True)
            self.failed |= not outcome.verdict.keeps_the_promise
        return still

    def _tried(self, trial: Trial) -> tuple[Trial, Outcome]:
        place = self._places.get()
        try:
            outcome = attempt(trial, place.folder, self._seeds, place.warm)
            if self._keep and not outcome.verdict.keeps_the_promise:
                self._kept(self._keep / trial.title.replace("/", "__").replace(" ", "_"), place.folder, trial, outcome)
            remove(place.folder)
        except Exception as defect:
            defect.add_note(f"in {trial.title}")
            raise
        finally:
            self._places.put(place)
        return trial, outcome

    def _kept(self, at: Path, folder: Path, trial: Trial, outcome: Outcome) -> None:
        """Keep the sandbox as the commands left it, what they were and how to repeat it."""
        remove(at)
        at.mkdir(parents=True)
        shutil.move(folder / "work", at / "work")
        again = f"tools/fuzz --seed {self._seed} --only '{trial.title}'"
        told = {"repeat": again, "verdict": outcome.verdict, "why": outcome.why}
        (at / "outcome.json").write_text(
            json.dumps({**told, "commands": [asdict(c) for c in outcome.commands]}, default=list, indent=1)
        )

    def _close(self) -> None:
        places = [self._places.get() for _ in range(self._count)]
        for place in places:
            place.warm.close()
            self._places.put(place)


def _until(trials: Iterable[Trial], end: float) -> Iterator[Trial]:
    for trial in trials:
        if time.monotonic() >= end:
            return
        yield trial

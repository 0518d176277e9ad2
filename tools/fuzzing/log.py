"""The log of a campaign: a line of JSON for each input, written as it was judged. A campaign that was stopped goes on
where its log ends."""

import json
import subprocess
from pathlib import Path
from typing import Any

from fuzzing.results import Judged, Results
from fuzzing.trial import Outcome, Trial, Verdict


class Log:
    """The lines in the file `path`; a campaign of one seed."""

    def __init__(self, path: Path, seed: int) -> None:
        """Open it, or begin a new one. Exits where the file is the log of another seed."""
        self._path, self._seed, self._commit = path, seed, _commit()
        seeds = {line["seed"] for line in self._lines()} - {seed}
        if seeds:
            raise SystemExit(f"{path} is the log of seed {seeds.pop()}: give --seed, or another file")

    def results(self) -> Results:
        """What came of each input when it was tried last."""
        results = Results()
        for line in self._lines():
            judged = Judged(kind=line["kind"], verdict=Verdict(line["verdict"]), seconds=line["seconds"])
            results.add(line["title"], judged)
        return results

    def add(self, trial: Trial, outcome: Outcome) -> None:
        """Write a line."""
        line: dict[str, Any] = {"title": trial.title, "kind": trial.kind, "verdict": outcome.verdict}
        line |= {"seconds": round(outcome.seconds, 2), "seed": self._seed, "commit": self._commit}
        if not outcome.verdict.keeps_the_promise:
            line["why"] = outcome.why
        with self._path.open("a") as file:
            file.write(json.dumps(line) + "\n")

    def _lines(self) -> list[dict[str, Any]]:
        """All lines; whoever was killed may have left a part of one at the end."""
        text = self._path.read_text() if self._path.exists() else ""
        whole = text[: text.rfind("\n") + 1]
        if whole != text:
            self._path.write_text(whole)
        return [json.loads(line) for line in whole.splitlines()]


def _commit() -> str:
    """The commit that is tried."""
    asked = ["git", "describe", "--always", "--dirty"]
    done = subprocess.run(asked, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"

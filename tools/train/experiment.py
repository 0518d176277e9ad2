"""Author, render, train and score what a file says, row by row: `tools/train/experiment --help`.

The file (tools/train/experiments has those of the documents) names sets of pictures, each with what `spin-usd author`
and `render` are given; rows, each with the set that a network learns from; and the sets that all rows are tried on.
Each row is done once for each seed. What is finished stands in tools/figures/training/NAME/ROW-SEED.json, and is not
done again unless the file asks for something else there, so a table goes on on another machine or another day. Stopped
anywhere and started again, it goes on where it was.

With --packs it renders, and writes there what another machine needs to learn: packs of pictures, and commands.txt, a
line for each row and seed. Once what they wrote, `rows`, is copied into the folder of --work, the same command without
--packs scores it.
"""

import argparse
import json
import os
import shlex
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

import spin_usd
from spin_usd.basics.progress import no_progress
from spin_usd.commands.score.matching import matched
from spin_usd.commands.score.predictions import read_predictions
from spin_usd.commands.score.truth import read_truth
from spin_usd.processes.processors import machine
from spin_usd.scoring.pose_errors import PoseErrors, scores
from train.pictures import datasets_in

ROOT = Path(__file__).resolve().parents[2]
FIGURES = ROOT / "tools" / "figures" / "training"
COMMAND = (sys.executable, "-m", "spin_usd.command_line")
BASELINE = "baseline"
"""The tool beside this one that learns poses, from which an experiment's `learner` may differ."""
COMMAND_THERE = ("python3", "-m", "train.baseline")  # on a machine that has packs; PYTHONPATH has ROOT and tools
PACK = ROOT / "tools" / "train" / "pack"
SEEN = ("frames", "appearances")  # a row's options that say what it sees of its set
LAST = 100  # steps whose mean loss a row keeps
BEDS = ("lightbox", "sunlamp")
CAMERA = "camera.json"
RESAMPLED, INTERVAL = 10_000, (0.025, 0.975)  # bootstrap samples; the quantiles of a 95 % interval


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """name · folder: of its file · training: options of the learner · seeds · sets, by name: `author` and `render`
    options of each · tests: names of those that rows are tried on · rows, by name: `set`, one or a list, and
    `frames`, `appearances` and options of the learner of their own · learner: the tool beside this one that learns."""

    name: str
    folder: Path
    training: Mapping[str, Any]
    seeds: Sequence[int]
    sets: Mapping[str, Mapping[str, Any]]
    tests: Sequence[str]
    rows: Mapping[str, Mapping[str, Any]]
    learner: str = BASELINE

    def files(self, name: str) -> dict[str, Path]:
        """Return those options of `author` for the set that are files beside the experiment's."""
        author = self.sets[name]["author"].items()
        return {each: file for each, value in author if (file := self.folder / str(value)).is_file()}

    def sources(self, row: str) -> list[str]:
        """Return the sets that the row learns from."""
        return _listed(self.rows[row].get("set"))

    def asked(self, name: str) -> list[Any]:
        """Return all that the set is made of: its options, and what its files hold."""
        files = self.files(name).items()
        return [self.sets[name], {each: file.read_text(errors="surrogateescape") for each, file in files}]


def read_experiment(path: Path) -> Experiment:
    """Read the experiment's file. Ends the program for one that is not understood."""
    try:
        found = tomllib.loads(path.read_text())
        read = Experiment(
            name=path.stem,
            folder=path.parent.resolve(),
            training=found["training"],
            seeds=found["seeds"],
            sets=found["set"],
            tests=found["tests"],
            rows=found["row"],
            learner=found.get("learner", BASELINE),
        )
    except (OSError, tomllib.TOMLDecodeError, KeyError) as error:
        raise SystemExit(f"{path} is no experiment: {error}") from None
    if not Path(__file__).with_name(read.learner).is_file():
        raise SystemExit(f"{path} has the learner {read.learner!r}; choose {BASELINE} or segmentation")
    wanted = {*read.tests, *(name for row in read.rows for name in read.sources(row))}
    if unknown := sorted(wanted - set(read.sets)):
        raise SystemExit(f"{path} has no set {', '.join(unknown)}; choose among {', '.join(read.sets)}")
    return read


class Work:
    """What an experiment makes in a folder: sets/NAME with stage and dataset, rows/NAME/SEED with the network."""

    def __init__(
        self, experiment: Experiment, folder: Path, speedplus: Path | None, also: Mapping[str, Path] | None = None
    ) -> None:
        """also: further tests, folders of one or more datasets."""
        self.experiment, self.folder, self.beds = experiment, folder, beds_of(speedplus) if speedplus else {}
        self.also = also or {}
        self._locks = {name: threading.Lock() for name in experiment.sets}

    def place(self, name: str) -> Path:
        """Return the set's folder: one of its own for each thing that the experiment's file has asked for."""
        return self.folder / "sets" / f"{name}-{_digest(self.experiment.asked(name))[:8]}"

    def dataset(self, name: str) -> Path:
        """Return the set's dataset, authored and rendered as far as it is not yet."""
        options, folder = self.experiment.sets[name], self.place(name)
        with self._locks[name]:
            if not (folder / "stage").is_dir():  # it is written as a whole, or not at all
                author = dict(options["author"]) | self.experiment.files(name)
                _timed(folder, (*COMMAND, "author", *_flags(author), "--out", str(folder / "stage")))
            if not (folder / "rendered").is_file():
                render = (str(folder / "stage"), *_flags(options["render"]), "--out", str(folder / "dataset"))
                _timed(folder, (*COMMAND, "render", *render))
                (folder / "rendered").write_text(_commit())
        return folder / "dataset"

    def cpu_s(self, name: str) -> float:
        """Return the processor seconds that the set has taken here."""
        found: float = json.loads((self.place(name) / "seconds.json").read_text())["cpu_s"]
        return found

    def row(self, name: str, seed: int) -> dict[str, Any]:
        """Make the row with that seed, and return what is kept of it."""
        row, folder = self.experiment.rows[name], self.folder / self.of_row(name, seed)
        sources = [self.dataset(each) for each in self.experiment.sources(name)]
        folder.mkdir(parents=True, exist_ok=True)
        truths = {test: self.dataset(test) for test in self.experiment.tests}
        truths |= {**self.beds, **self.also}
        keypoints = folder / "keypoints.json"
        if self.beds:
            keypoints.write_text(json.dumps(spin_usd.Dataset(sources[0]).keypoints.points.tolist()))
        beds = ["--keypoints", str(keypoints)] if self.beds else []
        command = [str(Path(__file__).with_name(self.experiment.learner)), *map(str, sources), *self.seen(name)]
        command += [*self.learning(name, seed, folder, truths), *beds]
        if not (folder / "training.json").is_file():  # else it was learned, here or on another machine
            with (folder / "log.txt").open("a") as log:
                if subprocess.run(command, stdout=log, stderr=subprocess.STDOUT).returncode:
                    raise SystemExit(f"{name} of seed {seed} ended with an error; {folder / 'log.txt'} says which")
        result = json.loads((folder / "training.json").read_text())
        every = sum(len(spin_usd.Dataset(each)) for each in sources)
        cpu_s = sum(self.cpu_s(each) for each in self.experiment.sources(name))
        return {
            "key": self.key(name),
            "row": name,
            "seed": seed,
            "set": row["set"],
            "pictures": result["pictures"],
            "training": result["training"],
            "loss": sum(result["losses"][-LAST:]) / len(result["losses"][-LAST:]),
            "train_cpu_s": result["cpu_s"],
            "render_cpu_s": cpu_s * result["pictures"] / every,
            "stages": {each: _stage_hash(self.dataset(each)) for each in self.made(name)},
            "scores": {test: self.score(folder, test, truth) for test, truth in truths.items()},
            "versions": {**result["versions"], "spin_usd": spin_usd.__version__},
            "machine": machine(),
            "device": result["device"],
            "commit": (self.place(self.experiment.sources(name)[0]) / "rendered").read_text() or None,
            "finished": result["finished"],
        }

    def score(self, folder: Path, test: str, truth: Path) -> dict[str, Any]:
        """Return the scores of a row on a test: of its poses, or those that its learner wrote."""
        if self.experiment.learner == BASELINE:
            return _score(folder / f"{test}.csv", truth)
        found: dict[str, Any] = json.loads((folder / f"{test}.json").read_text())
        return found

    def of_row(self, name: str, seed: int) -> Path:
        """Return the row's folder, in that of the work or of packs."""
        return Path("rows") / f"{name}-{self.key(name)[:8]}" / str(seed)

    def seen(self, name: str) -> list[str]:
        """Return options that say what the row sees of its set."""
        return _flags({key: value for key, value in self.experiment.rows[name].items() if key in SEEN})

    def learning(self, name: str, seed: int, out: Path, tests: Mapping[str, Path]) -> list[str]:
        """Return the other options of the baseline for the row."""
        own = {key: value for key, value in self.experiment.rows[name].items() if key not in ("set", *SEEN)}
        options = {**self.experiment.training, **own, "seed": seed, "out": out}
        return [*_flags(options), *(word for test, path in tests.items() for word in ("--test", f"{test}={path}"))]

    def pack(self, left: Sequence[tuple[str, int]], folder: Path) -> None:
        """Write into the folder packs of all that those rows need, and the commands that learn from them."""
        tests = {test: Path("tests") / f"{test}.npz" for test in self.experiment.tests}
        rows = {name: self.of_row(name, seed).parent / "pack.npz" for name, seed in left}
        seen: dict[Path, tuple[list[str], list[str]]] = {file: ([test], []) for test, file in tests.items()}
        seen |= {file: (self.experiment.sources(name), self.seen(name)) for name, file in rows.items()}
        for file, (of, options) in seen.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            subprocess.run([str(PACK), *map(str, map(self.dataset, of)), str(folder / file), *options], check=True)
        lines = [
            shlex.join([*COMMAND_THERE, str(rows[name]), *self.learning(name, seed, self.of_row(name, seed), tests)])
            for name, seed in left
        ]
        (folder / "commands.txt").write_text("".join(f"{line}\n" for line in lines))

    def key(self, name: str) -> str:
        """Return the digest of all that the experiment's file asks of the row but the seed."""
        experiment, row = self.experiment, self.experiment.rows[name]
        sets = {each: experiment.asked(each) for each in self.made(name)}
        beds = {bed: sha256(file.read_bytes()).hexdigest() for bed, file in self.beds.items()}
        also = {test: [_stage_hash(each) for each in datasets_in(folder)] for test, folder in self.also.items()}
        return _digest([experiment.training, row, sets, beds or (), *([also] if also else [])])

    def made(self, name: str) -> list[str]:
        """Return the sets that the row needs: those that it learns from, and the tests."""
        return [*self.experiment.sources(name), *self.experiment.tests]


def beds_of(folder: Path) -> dict[str, Path]:
    """Return the pose lists of real pictures in the folder, by name: the beds of SPEED+, or the only list, beside its
    pictures. Ends the program if there is none."""
    if found := {bed: file for bed in BEDS if (file := folder / bed / "test.json").is_file()}:
        return found
    lists = [file for file in folder.glob("*.json") if file.name != CAMERA]
    if len(lists) != 1:
        wanted = " nor ".join(f"{bed}/test.json" for bed in BEDS)
        raise SystemExit(f"{folder} has neither {wanted}; instead of one pose list, *.json, it has {len(lists)}")
    return {lists[0].stem: lists[0]}


def _listed(names: Any) -> list[str]:
    return [str(each) for each in names] if isinstance(names, list) else [str(names)]


def _digest(value: object) -> str:
    return sha256(json.dumps(value, sort_keys=True, default=str).encode()).hexdigest()


def _flags(options: Mapping[str, Any]) -> list[str]:
    """Return options as the command line has them: true is a flag alone."""
    flags = []
    for name, value in options.items():
        flag = f"--{name.replace('_', '-')}"
        flags += [flag] if value is True else [flag, str(value)]
    return flags


def _timed(folder: Path, command: Sequence[str]) -> None:
    """Run a command of ours, and add the processor seconds of it and its children to those of the folder, also where it
    is stopped. Ends the program where it fails."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "seconds.json"
    spent = json.loads(file.read_text())["cpu_s"] if file.is_file() else 0.0
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        _, status, usage = os.wait4(process.pid, 0)
    except BaseException:
        _, status, usage = os.wait4(process.pid, 0)
        file.write_text(json.dumps({"cpu_s": spent + usage.ru_utime + usage.ru_stime}))
        raise
    process.returncode = os.waitstatus_to_exitcode(status)
    file.write_text(json.dumps({"cpu_s": spent + usage.ru_utime + usage.ru_stime}))
    if process.returncode:
        raise SystemExit(f"ended with {process.returncode}: {' '.join(command)}")


def _commit() -> str:
    """Return the repository's commit, with a + where the working tree is not it."""
    git = partial(subprocess.run, cwd=ROOT, capture_output=True, text=True)
    head = git(["git", "rev-parse", "--short=8", "HEAD"]).stdout.strip()
    return f"{head}{'+' if git(['git', 'status', '--porcelain', 'spin_usd', 'stages']).stdout else ''}"


def _stage_hash(dataset: Path) -> str:
    found: str = spin_usd.Dataset(dataset)[0].record["provenance"]["stage"]["hash"]
    return found


def _score(predictions: Path, truth: Path) -> dict[str, Any]:
    command = (*COMMAND, "score", str(predictions), "--truth", str(truth), "--json", "--quiet")
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    found: dict[str, Any] = json.loads(done.stdout)["all"]
    return found | {"interval_95": _intervals(predictions, truth)}


def _intervals(predictions: Path, truth: Path) -> dict[str, list[float]]:
    """Return bootstrap intervals over the pictures, 95 %, of the SPEED+ score and of the median error of attitude."""
    of = read_truth(truth, variants=(), target=None, progress=no_progress)
    found = matched(read_predictions(predictions), of, partial=False)
    errors = PoseErrors.of(q=found.q, t=found.t, true_q=of.q[found.places], true_t=of.t[found.places])
    again = np.random.default_rng(0).integers(len(found.q), size=(RESAMPLED, len(found.q)))
    drawn = {
        "speedplus": scores(errors, "speedplus")[again].mean(1),
        "attitude_deg_median": np.median(np.degrees(errors.attitude)[again], axis=1),
    }
    return {name: np.quantile(values, INTERVAL).tolist() for name, values in drawn.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("experiment", type=Path, metavar="SPEC.toml")
    parser.add_argument("--work", type=Path, required=True, help="folder of stages, datasets and networks: gigabytes")
    parser.add_argument("--figures", type=Path, default=FIGURES, help="folder of what is finished")
    parser.add_argument("--rows", metavar="NAME,...", help="some of the rows")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="networks that learn at a time")
    parser.add_argument("--packs", type=Path, help="render, and write there what another machine needs to learn")
    parser.add_argument(
        "--speedplus",
        type=Path,
        help="also score rows on the real pictures of SPEED+, or of a folder with one pose list",
    )
    parser.add_argument(
        "--also",
        action="append",
        default=[],
        metavar="NAME=FOLDER",
        help="also try rows on a dataset, or on the datasets FOLDER/*/dataset",
    )
    given = parser.parse_args()
    if given.packs and (given.speedplus or given.also):
        parser.error("--packs holds sets of the experiment alone, not those of --speedplus and --also")
    experiment = read_experiment(given.experiment)
    also = {name: Path(folder).resolve() for name, _, folder in (each.partition("=") for each in given.also)}
    work = Work(experiment, given.work.resolve(), given.speedplus and given.speedplus.resolve(), also)
    rows = given.rows.split(",") if given.rows else list(experiment.rows)
    if unknown := [name for name in rows if name not in experiment.rows]:
        raise SystemExit(
            f"{given.experiment} has no row {', '.join(unknown)}; choose among {', '.join(experiment.rows)}"
        )
    files = {(n, s): given.figures / experiment.name / f"{n}-{s}.json" for s in experiment.seeds for n in rows}
    left = {at: file for at, file in files.items() if not _is_finished(file, work.key(at[0]))}
    print(f"{len(files) - len(left)} of {len(files)} are finished", flush=True)
    begun = time.monotonic()
    for name in dict.fromkeys(name for row, _ in left for name in work.made(row)):
        print(f"rendering: set {name}", flush=True)
        work.dataset(name)
    print(f"all sets are rendered, {time.monotonic() - begun:.0f} s", flush=True)
    if given.packs:
        work.pack(list(left), given.packs)
        return
    begun = time.monotonic()
    with ThreadPoolExecutor(given.jobs) as pool:
        running = {pool.submit(work.row, *at): at for at in left}
        try:
            for done, future in enumerate(as_completed(running), start=1):
                _keep(left[running[future]], future.result())
                to_go = (time.monotonic() - begun) / done * (len(left) - done)
                print(
                    f"row {running[future][0]}, seed {running[future][1]}: {done} of {len(left)}, {to_go:.0f} s left",
                    flush=True,
                )
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _is_finished(file: Path, key: str) -> bool:
    return file.is_file() and json.loads(file.read_text())["key"] == key


def _keep(file: Path, found: Mapping[str, Any]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    new = file.with_suffix(".new")
    new.write_text(json.dumps(found, indent=1) + "\n")
    os.replace(new, file)


if __name__ == "__main__":
    main()

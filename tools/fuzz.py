"""Give spin-usd mutants of every format that it reads, and tell what came of them in a table.

    tools/fuzz [--minutes M | --mutants N] [--seed S] [--keep DIR]
    tools/fuzz --only NAME [--seed S]

A mutant keeps the promises of SECURITY.md when its command ends within 20 s with exit code 0, 1 or 2 and without a
traceback, reads and changes nothing outside its folder, loses nothing of the user's, and leaves nothing behind. What
does not is kept in DIR, with the command that repeats it; --only with its name tries it again. Exit code 1: some did
not keep the promises.
"""

import argparse
import json
import multiprocessing
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from itertools import count, islice
from pathlib import Path
from threading import Lock

from fuzz_inputs import SUBJECTS, Subject, make_seeds, mutate

from spin_usd.command_line import run as run_command_line
from spin_usd.processes.child import IN_PROCESS

PATIENCE_S = 20.0
MEMORY = 6 << 30
TRACE = re.compile(r"Traceback \(most recent|internal error")
CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
OUTSIDE = {"secret.usda": '#usda 1.0\ndef Cube "Secret"\n{\n}\n', "secret.mtl": "newmtl red\n", "secret.json": "[]"}
USERS = "thesis.txt"  # a file that is the user's, wherever it lies
OWN = ("out", "ds", "st")  # folders that commands may change
NEVER = 1  # second of 1970 when a file was read last: a file system sets another one when somebody reads it
# Modules that commands import when they are called, and that take long: every command starts with them loaded.
LOADED = (
    "commands.author.in_child",
    "commands.author.augment",
    "commands.check.run",
    "commands.check.in_child",
    "commands.export.in_child",
    "commands.render.run",
    "commands.render.worker",
    "commands.reproduce.run",
    "planning.in_child",
    "renderers.raycast.renderer",
)


class Verdict(StrEnum):
    """What came of a mutant, the worst last; the first three keep the promises."""

    FINE = "fine"
    FINDINGS = "findings"
    REFUSED = "refused"
    TRACEBACK = "tracebacks"
    CRASH = "crashes"
    HANG = "hangs"
    LOSS = "losses"
    ESCAPE = "escapes"


PROMISED = {0: Verdict.FINE, 1: Verdict.FINDINGS, 2: Verdict.REFUSED}
"""By exit code."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """arguments: of the command · why: what was seen, for a report."""

    title: str
    verdict: Verdict
    arguments: tuple[str, ...]
    why: str

    @property
    def broken(self) -> bool:
        return self.verdict not in PROMISED.values()


class Sandbox:
    """`work`: where the command is called · `outside`: files beside it · `home`, `tmp`: what the environment names."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.work, self.outside = folder, folder / "work", folder / "outside"
        for each in (self.work, self.outside, folder / "home", folder / "tmp"):
            each.mkdir(parents=True)
        for name, text in OUTSIDE.items():
            (self.outside / name).write_text(text)

    def begin(self) -> None:
        """Begin to watch: what is there now is prepared."""
        for folder in (self.work, *(self.work / name for name in OWN)):
            if folder.is_dir():
                (folder / USERS).write_text("precious")
        for file in self.outside.iterdir():
            os.utime(file, (NEVER, file.stat().st_mtime))
        self._before = listing(self.folder)

    def faults(self) -> Iterator[tuple[Verdict, str]]:
        """What was lost, is left over, and was read or changed outside since."""
        before, after = self._before, listing(self.folder)
        for name in sorted({name for name in before if before[name] != after.get(name)}):
            if name.startswith("outside/"):
                yield Verdict.ESCAPE, f"changed: {name}"
            elif Path(name).name == USERS or not name.startswith(tuple(f"work/{own}" for own in OWN)):
                yield Verdict.LOSS, f"lost: {name}"
        for name in sorted(after.keys() - before.keys()):
            if name.startswith("outside/"):
                yield Verdict.ESCAPE, f"made: {name}"
            elif re.match(r"tmp/|work/\.[^/]*$", name):
                yield Verdict.LOSS, f"left: {name}"
        for file in self.outside.iterdir():
            if file.name in OUTSIDE and file.stat().st_atime != NEVER:
                yield Verdict.ESCAPE, f"read: outside/{file.name}"


def listing(folder: Path) -> dict[str, str]:
    """By path below `folder`, but of `home`, what would differ had it been written since; folders are left out."""
    found = {path.relative_to(folder).as_posix(): path.lstat() for path in folder.rglob("*") if not path.is_dir()}
    return {n: f"{s.st_ino} {s.st_size} {s.st_mtime_ns}" for n, s in found.items() if not n.startswith("home/")}


def verdict_of(code: int | None, said: str) -> Verdict:
    """What the exit code, None where it had to be ended, and the text say."""
    if code is None:
        return Verdict.HANG
    if TRACE.search(said):
        return Verdict.TRACEBACK
    if code not in PROMISED:
        return Verdict.CRASH
    return Verdict.ESCAPE if CONTROL.search(said) else PROMISED[code]


def attempt(subject: Subject, seeds: Path, seed: int, number: int, keep: Path | None) -> Outcome:
    """Try a mutant. What breaks a promise without child processes is tried again as a user would: that decides, as a
    child that crashes is survived there."""
    title = f"{subject.name}/{number}"
    for alone in (False, True):
        with tempfile.TemporaryDirectory(prefix="spin-usd-fuzz-") as folder:
            sandbox = Sandbox(Path(folder).resolve() / "sandbox")
            arguments = mutate(subject, seeds, sandbox.work, f"{seed}/{title}")
            sandbox.begin()
            code, said = (_run_alone if alone else _run_warm)(arguments, sandbox.folder)
            found = [(verdict_of(code, said), f"exit {code}: {said[-600:]}"), *sandbox.faults()]
            verdict, why = max(found, key=lambda each: tuple(Verdict).index(each[0]))
            outcome = Outcome(title=title, verdict=verdict, arguments=arguments, why=why)
            if not outcome.broken:
                return outcome
            if keep and alone:
                at = keep / title.replace("/", "__")
                shutil.rmtree(at, ignore_errors=True)
                shutil.copytree(sandbox.work, at, symlinks=True)
                again = f"tools/fuzz --seed {seed} --only {title}"
                (at / "outcome.json").write_text(json.dumps({"repeat": again, "why": why, "arguments": arguments}))
    return outcome


def _run_warm(arguments: tuple[str, ...], sandbox: Path) -> tuple[int | None, str]:
    """The exit code, None where the command had to be ended, and what it printed: in a fork of a process that has
    loaded all that commands need, with what children do in the same process."""
    heard = sandbox / "home" / "printed"
    process = multiprocessing.get_context("forkserver").Process(target=_called, args=(arguments, sandbox, heard))
    process.start()
    process.join(_patience())
    late = process.exitcode is None
    process.kill()
    process.join()
    return None if late else process.exitcode, heard.read_text(errors="replace") if heard.is_file() else ""


def _called(arguments: tuple[str, ...], sandbox: Path, heard: Path) -> None:
    """In the fork: call the command line, which ends it."""
    descriptor = os.open(heard, os.O_WRONLY | os.O_CREAT)
    for standard in (1, 2):
        os.dup2(descriptor, standard)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    os.environ |= _environment(sandbox)
    tempfile.tempdir = None
    os.chdir(sandbox / "work")
    sys.argv = ["spin-usd", *arguments]
    run_command_line()


def _run_alone(arguments: tuple[str, ...], sandbox: Path) -> tuple[int | None, str]:
    """The same, as a user does: in a process of its own, with children."""
    environment = {name: value for name, value in os.environ.items() if name != IN_PROCESS} | _environment(sandbox)
    command = [sys.executable, "-P", "-m", "spin_usd.command_line", *arguments]
    with (sandbox / "home" / "printed").open("w+b") as heard:
        process = subprocess.Popen(command, cwd=sandbox / "work", env=environment, stdout=heard, stderr=heard)
        code = None
        with suppress(subprocess.TimeoutExpired):
            code = process.wait(_patience())
        process.kill()
        process.wait()
        heard.seek(0)
        return code, heard.read().decode(errors="replace")


def _environment(sandbox: Path) -> dict[str, str]:
    return {"HOME": str(sandbox / "home"), "TMPDIR": str(sandbox / "tmp"), "COLUMNS": "120"}


def _patience() -> float:
    """PATIENCE_S of a processor of one's own: more where more programs run than there are processors."""
    return PATIENCE_S * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def mutants() -> Iterator[tuple[Subject, int]]:
    """Subjects and numbers without end: one of each subject in turn."""
    return ((subject, number) for number in count() for subject in SUBJECTS)


def table(outcomes: Iterable[Outcome]) -> str:
    """Return a line of Markdown for each group of formats, and their sum."""
    groups: dict[str, Counter[Verdict]] = {}
    of = {subject.name: subject.group for subject in SUBJECTS}
    for outcome in outcomes:
        for name in (of[outcome.title.rpartition("/")[0]], "all"):
            groups.setdefault(name, Counter())[outcome.verdict] += 1
    groups["all"] = groups.pop("all", Counter())
    head = ["| class | inputs | " + " | ".join(Verdict) + " |", "| --- |" + " ---: |" * (1 + len(Verdict))]
    rows = ([name, counts.total(), *(counts[verdict] for verdict in Verdict)] for name, counts in groups.items())
    return "\n".join([*head, *("| " + " | ".join(map(str, row)) + " |" for row in rows)])


def main() -> int:
    options = _options()
    os.environ[IN_PROCESS] = "1"
    multiprocessing.get_context("forkserver").set_forkserver_preload([f"spin_usd.{name}" for name in LOADED])
    chosen = mutants()
    if options.only:
        name, _, number = options.only.rpartition("/")
        chosen = ((subject, int(number)) for subject in SUBJECTS if subject.name == name)
    elif options.mutants:
        chosen = islice(chosen, options.mutants)
    outcomes: list[Outcome] = []
    with tempfile.TemporaryDirectory(prefix="spin-usd-seeds-") as folder, ThreadPoolExecutor(options.workers) as pool:
        seeds = Path(folder).resolve()
        make_seeds(seeds)
        turn = Lock()
        end = time.monotonic() + (60 * options.minutes if not (options.only or options.mutants) else float("inf"))

        def try_next(_: int) -> None:
            while time.monotonic() < end:
                with turn:
                    mutant = next(chosen, None)
                if mutant is None:
                    return
                outcome = attempt(mutant[0], seeds, options.seed, mutant[1], options.keep)
                outcomes.append(outcome)
                if outcome.broken or options.only:
                    print(f"{outcome.title}: {outcome.verdict}: {outcome.why!r}", file=sys.stderr, flush=True)

        list(pool.map(try_next, range(options.workers)))
    print(f"Seed {options.seed}.\n\n{table(outcomes)}")
    return int(any(outcome.broken for outcome in outcomes))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0, help="how long")
    parser.add_argument("--mutants", type=int, default=0, metavar="N", help="so many, however long they take")
    parser.add_argument("--seed", type=int, default=0, help="another seed, other mutants")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="where inputs that fail are kept")
    parser.add_argument("--only", metavar="NAME", help="one mutant, such as usda/17")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="how many are tried at once")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())

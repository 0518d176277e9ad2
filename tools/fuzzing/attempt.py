"""Try one input: prepare it, call its commands, and judge what they did."""

import re
from collections.abc import Callable
from pathlib import Path

from fuzzing.running.ended import Command, Ended
from fuzzing.running.process import processes_left, run_process
from fuzzing.running.warm import WarmRunner
from fuzzing.sandbox import Sandbox
from fuzzing.trial import ORDER, Outcome, Trial, Verdict

TRACE = re.compile(r"Traceback \(most recent|internal error")
CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
TAIL = 600
BY_CODE = {0: Verdict.FINE, 1: Verdict.FINDINGS, 2: Verdict.REFUSED}
Run = Callable[[Command, Path], Ended]


def attempt(trial: Trial, folder: Path, seeds: Path, warm: WarmRunner | None) -> Outcome:
    """Try it in a sandbox in `folder`. What breaks a promise in the warm process is tried again as a user would: that
    decides, as a child that crashes is survived there."""
    if warm and not trial.alone:
        outcome = _attempt(trial, Sandbox(folder, seeds), warm.run)
        if outcome.verdict.keeps_the_promise:
            return outcome
    return _attempt(
        trial, Sandbox(folder, seeds), lambda command, at: run_process(command, at, patience_s=trial.patience_s)
    )


def _attempt(trial: Trial, sandbox: Sandbox, run: Run) -> Outcome:
    commands = tuple(trial.prepare(sandbox))
    sandbox.begin()
    verdicts: list[tuple[Verdict, str]] = []
    slowest = 0.0
    for command in commands:
        ended = run(command, sandbox.folder)
        slowest = max(slowest, ended.seconds)
        verdicts.append((verdict_of(command, ended), _said(ended)))
    verdicts += _traces(trial, sandbox)
    verdict, why = max(verdicts, key=lambda each: ORDER.index(each[0]))
    return Outcome(verdict=verdict, commands=commands, why=why, seconds=slowest)


def _traces(trial: Trial, sandbox: Sandbox) -> list[tuple[Verdict, str]]:
    """What the commands left behind or touched."""
    left = processes_left(sandbox.folder) if trial.alone else []
    sandbox.end()
    losses = [*sandbox.losses(trial.own), *left]
    escapes = sandbox.escapes()
    found = [(Verdict.LOSS, "; ".join(losses)[:TAIL])] if losses else []
    return [*found, (Verdict.ESCAPE, "; ".join(escapes)[:TAIL])] if escapes else found


def verdict_of(command: Command, ended: Ended) -> Verdict:
    """What the exit code and the text say."""
    if ended.code is None:
        return Verdict.HANG
    if TRACE.search(ended.err) or TRACE.search(ended.out):
        return Verdict.TRACEBACK
    if ended.code not in command.allowed:
        return Verdict.CRASH
    if CONTROL.search(ended.err) or CONTROL.search(ended.out):
        return Verdict.ESCAPE
    return BY_CODE.get(ended.code, Verdict.REFUSED)


def _said(ended: Ended) -> str:
    """The end of what was printed, for a report."""
    return f"exit {ended.code} after {ended.seconds:.1f} s: {(ended.err or ended.out)[-TAIL:]}"

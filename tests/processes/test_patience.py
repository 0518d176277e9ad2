"""A limit counts what a child does: one that runs away or hangs is ended, one that cannot run is waited for."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from types import NoneType

import pytest

from spin_usd.processes import patience
from spin_usd.processes.call import Call
from spin_usd.processes.child import Child
from spin_usd.processes.deaths import ChildDiedError, DeathCause
from spin_usd.processes.patience import Patience
from spin_usd.processes.pool import Answered, Failed, Pool
from spin_usd.processes.usage import Usage, UsageMeter

pytestmark = pytest.mark.children


NOTHING = Call("nothing:nothing", NoneType, int)
LOOP = "while True: pass"
SLEEP = "import time; time.sleep(1000)"
NAP = "import time\nwhile True: time.sleep(0.02)"
ANSWER = f"print({json.dumps(json.dumps({'result': 7}))}, flush=True); input()"
WORK = f"import time\nend = time.process_time() + 0.3\nwhile time.process_time() < end: pass\n{ANSWER}"
linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux says how long a thread waited for a processor")


@pytest.fixture
def started(tmp_path, monkeypatch):
    """Return what starts a child that runs a program of the test's in place of ours."""
    children: list[Child] = []

    def start(program):
        script = tmp_path / f"python{len(children)}"
        (tmp_path / f"{len(children)}.py").write_text(program)
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -I "{tmp_path / f"{len(children)}.py"}"\n')
        script.chmod(0o700)
        with monkeypatch.context() as patched:
            patched.setattr(sys, "executable", str(script))
            children.append(Child())
        return children[-1]

    yield start
    for child in children:
        child.kill()


def asked_of_a_child(child, within_s):
    return child.call(NOTHING, None, within_s=within_s)


def asked_of_a_pool(child, within_s):
    with Pool[int]() as pool:
        pool.add(0, child)
        pool.send(0, NOTHING, None, within_s=within_s)
        while not (events := list(pool.wait())):
            pass
        match events:
            case [Answered(result=result)]:
                return result
            case [Failed(reason=reason)]:
                raise reason


ASKED = pytest.mark.parametrize("asked", [asked_of_a_child, asked_of_a_pool])


@ASKED
@pytest.mark.parametrize(
    ("program", "cause", "words"),
    [
        (
            LOOP,
            DeathCause.RAN_AWAY,
            "of processor time, more than its limit of 0.3 s$",
        ),
        (SLEEP, DeathCause.HUNG, r"^the worker process used no processor time for \S+ s$"),
        (NAP, DeathCause.HUNG, "used no processor time"),
    ],
)
def test_a_child_that_runs_away_or_hangs_is_ended_and_it_is_said_which(started, asked, program, cause, words) -> None:
    child = started(program)
    with pytest.raises(ChildDiedError, match=words) as died:
        asked(child, 0.3)
    assert died.value.cause == cause
    assert child.process.poll() == -signal.SIGKILL


def test_a_loop_in_a_process_that_the_child_started_is_the_childs(started) -> None:
    child = started(f"import subprocess, sys; subprocess.run([sys.executable, '-c', {LOOP!r}])")
    with pytest.raises(ChildDiedError) as died:
        asked_of_a_child(child, 0.3)
    assert died.value.cause == DeathCause.RAN_AWAY


@pytest.mark.parametrize("asked", [asked_of_a_child, asked_of_a_pool])
def test_a_child_that_is_stopped_for_longer_than_its_limit_loses_nothing(started, asked, caplog, monkeypatch) -> None:
    monkeypatch.setattr(patience, "STOPPED_S", 0.25)
    patience._say.cache_clear()
    child = started(WORK)
    child.process.send_signal(signal.SIGSTOP)
    threading.Timer(1.5, child.process.send_signal, [signal.SIGCONT]).start()
    assert asked(child, 0.6) == 7
    (record,) = [each for each in caplog.records if each.name.startswith("spin_usd")]
    assert record.getMessage().startswith(f"the worker process {child.process.pid} is stopped")


@linux
@ASKED
def test_a_child_that_waits_for_a_processor_loses_nothing(started, asked, caplog) -> None:
    """Eight others want its processor."""
    patience._say.cache_clear()
    child = started(WORK)
    processor = {min(os.sched_getaffinity(0))}
    others = [subprocess.Popen([sys.executable, "-c", LOOP], start_new_session=True) for _ in range(8)]
    try:
        for process in (child.process, *others):
            os.sched_setaffinity(process.pid, processor)
        began = time.monotonic()
        assert asked(child, 0.6) == 7
        assert time.monotonic() - began > 1.5
    finally:
        for process in others:
            process.kill()
            process.wait()
    assert [each.getMessage() for each in caplog.records if "the machine is busy" in each.getMessage()]


@linux
def test_threads_count_as_the_clock_on_a_free_machine_would() -> None:
    """Two threads that share one processor ran half as long as the clock did."""
    loop = "import time\nwhile True: time.process_time()"
    processes = [
        subprocess.Popen([sys.executable, "-c", loop], preexec_fn=lambda: os.sched_setaffinity(0, {0}))
        for _ in range(2)
    ]
    try:
        meter = UsageMeter(processes[0].pid)
        meter.look()
        began = time.monotonic()
        time.sleep(0.8)
        usage, clock = meter.look(), time.monotonic() - began
    finally:
        for process in processes:
            process.kill()
            process.wait()
    assert usage.busy_s < 0.7 * clock
    assert usage.idle_s < 0.2 * clock


def test_a_process_that_has_ended_uses_nothing() -> None:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    assert UsageMeter(process.pid).look() == Usage()


def test_a_look_costs_little() -> None:
    """A worker is looked at twice a second."""
    meter = UsageMeter(os.getpid())
    began = time.process_time()
    for _ in range(100):
        meter.look()
    assert (time.process_time() - began) / 100 < 0.002


def test_the_first_look_is_what_others_are_counted_from() -> None:
    """A child is looked at before it is asked, too."""
    limit = Patience(1.0)
    assert limit.exhausted(Usage(busy_s=50.0, idle_s=70.0), "it") is None
    assert limit.exhausted(Usage(busy_s=50.9, idle_s=70.9), "it") is None
    assert limit.exhausted(Usage(busy_s=51.1, idle_s=70.9), "it").cause == DeathCause.RAN_AWAY

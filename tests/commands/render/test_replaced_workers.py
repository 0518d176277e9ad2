"""Children that are killed or stopped while they plan or render are replaced, and nothing is lost or made twice."""

import signal
import threading
from contextlib import contextmanager, suppress

import psutil
import pytest

from spin_usd.basics.progress import no_progress
from spin_usd.commands.render.run import render_dataset
from spin_usd.errors import RenderError
from spin_usd.options import RunOptions
from spin_usd.planning.render_plan import plan
from spin_usd.planning.time_limit import TimeLimits
from spin_usd.processes.deaths import TRIES, ChildDiedError, DeathCause, Retries
from spin_usd.scene.effort import Effort
from tests.cases.requests import request_for

pytestmark = pytest.mark.children


FEW = Effort(samples=2)
KILLED = TRIES[DeathCause.KILLED]


def children():
    found = []
    for child in psutil.Process().children():
        with suppress(psutil.Error):
            if "spin_usd.processes.child_main" in child.cmdline():
                found.append(child)
    return found


@contextmanager
def killing(most):
    """Kill each child that this process starts, `most` of them at most; give the list of those killed."""
    killed: list[int] = []
    ended = threading.Event()

    def kill() -> None:
        while not ended.wait(0.01) and len(killed) < most:
            for child in children():
                if child.pid not in killed and len(killed) < most:
                    killed.append(child.pid)
                    child.kill()

    thread = threading.Thread(target=kill)
    thread.start()
    try:
        yield killed
    finally:
        ended.set()
        thread.join()


def test_a_planning_child_that_is_killed_is_replaced(small_stage) -> None:
    request = request_for(small_stage, renderer="raycast", effort=FEW)
    with killing(most=KILLED - 1) as killed:
        planned = plan(request, progress=no_progress)
    assert len(killed) == KILLED - 1
    assert len(planned.pictures) == 8


def test_planning_children_that_are_killed_again_and_again_are_not_the_stages_fault(small_stage) -> None:
    request = request_for(small_stage, renderer="raycast", effort=FEW)
    with killing(most=100) as killed, pytest.raises(RenderError, match=f"killed|SIGKILL.*, {KILLED} times") as raised:
        plan(request, progress=no_progress)
    assert len(killed) == KILLED
    assert not isinstance(raised.value, ChildDiedError)
    assert "simplify" not in str(raised.value)


def rendered(stage, out, **options):
    request = request_for(stage, renderer="raycast", frames="0:2", effort=options.pop("effort", FEW))
    return render_dataset(request, out, RunOptions(workers=1, **options), progress=no_progress)


def files(out):
    kept = ((path.relative_to(out), path) for path in out.rglob("*") if path.name != "measured.json")
    return {name: path.read_bytes() for name, path in kept if path.is_file()}


@pytest.mark.slow
def test_a_worker_that_is_stopped_for_longer_than_its_limit_makes_its_picture(small_stage, tmp_path, monkeypatch):
    """It is stopped where its time for the picture begins."""
    stopped: list[psutil.Process] = []

    def stop(limits, picture, kinds):
        if not stopped:
            stopped.extend(children())
            stopped[0].send_signal(signal.SIGSTOP)
            threading.Timer(4.0, stopped[0].send_signal, [signal.SIGCONT]).start()
        return 2.0

    rendered(small_stage, tmp_path / "whole")
    monkeypatch.setattr(TimeLimits, "of", stop)
    with monkeypatch.context() as patched:
        patched.setattr(Retries, "may_try_again", lambda *_: False)
        report = rendered(small_stage, tmp_path / "stopped")
    assert len(stopped) == 1
    assert (report.made, report.failed) == (2, [])
    assert files(tmp_path / "stopped") == files(tmp_path / "whole")
    assert children() == []


@pytest.mark.slow
def test_a_picture_that_takes_too_long_has_failed_and_the_run_goes_on(small_stage, tmp_path) -> None:
    """The message says why, and its command makes that picture alone."""
    report = rendered(small_stage, tmp_path, effort=Effort(samples=10**6), picture_timeout=1)
    assert [each.picture for each in report.failed] == ["nominal/img000001", "nominal/img000002"]
    for index, reason in enumerate(each.reason for each in report.failed):
        assert "s of processor time, more than its limit of 1 s, twice; --picture-timeout allows more; to" in reason
        assert reason.endswith(" --picture-timeout 1")
        assert (
            f"spin-usd render {small_stage} --out {tmp_path} --frames {index}:{index + 1} --variants nominal" in reason
        )

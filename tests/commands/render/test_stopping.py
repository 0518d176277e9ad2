"""Runs that are asked to stop: the first signal lets running pictures be finished, the second ends them."""

import json
import os
import pty
import signal
import subprocess
import sys
import time
from contextlib import suppress

import psutil
import pytest

from spin_usd.files.sha256 import sha256_of
from tests.cases.records import records_of

pytestmark = pytest.mark.children


STARTS_WITHIN_S = 200.0
SLOW, QUICK = "samples=200", "samples=2"


def started(stage, out, *options, **how):
    command = [
        sys.executable,
        "-m",
        "spin_usd.command_line",
        "render",
        stage,
        "--out",
        out,
        "--renderer",
        "raycast",
        *options,
    ]
    return subprocess.Popen(list(map(str, command)), **{"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, **how})


def wait_until(condition, process) -> None:
    end = time.monotonic() + STARTS_WITHIN_S
    while not condition():
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.01)


def begun(out):
    """Whether a worker is at a picture: a file of its own is there before the first record."""
    return any((out / "depth").glob("*/*.exr")) or any((out / "records").glob("*/*.json"))


def children_of(process):
    with suppress(psutil.Error):
        return psutil.Process(process.pid).children()
    return []


def assert_left_well(out, children) -> int:
    """Nothing is left of the run but whole pictures; return how many."""
    _, alive = psutil.wait_procs(children, timeout=10)
    assert not alive
    assert {path.name for path in out.iterdir()} <= {
        "dataset.json", "stage", "records", "image", "depth", "segmentation", "dense_pose", "cache"
    }  # fmt: skip
    records = records_of(out)
    entries = [entry for record in records for entry in record["files"].values()]
    assert all(sha256_of(out / entry["path"]) == entry["sha256"] for entry in entries)
    return len(records)


@pytest.mark.slow
def test_the_first_signal_lets_running_pictures_be_finished(small_stage, tmp_path) -> None:
    process = started(small_stage, tmp_path, "--effort", SLOW, "--workers", "2")
    wait_until(lambda: begun(tmp_path), process)
    children = children_of(process)
    process.send_signal(signal.SIGTERM)
    said = process.communicate(timeout=STARTS_WITHIN_S)[1].decode()
    assert process.returncode == 128 + signal.SIGTERM
    assert "; Ctrl-C or SIGTERM now stops at once" in said
    assert "stopped by SIGTERM; run the same command again" in said
    made = assert_left_well(tmp_path, children)
    assert 1 <= made < 8
    assert f"note: {made} of 8 pictures are made; {8 - made} are missing" in said


@pytest.mark.slow
def test_the_second_stops_at_once_and_the_next_run_makes_the_rest(small_stage, tmp_path, spin_usd) -> None:
    """A third is not heard any more, while the second ends the run."""
    process = started(small_stage, tmp_path, "--effort", "samples=100000", "--workers", "1")
    wait_until(lambda: begun(tmp_path), process)
    children = children_of(process)
    process.send_signal(signal.SIGINT)
    assert process.stderr is not None
    while b"stops at once" not in process.stderr.readline():
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=STARTS_WITHIN_S) in (128 + signal.SIGINT, 128 + signal.SIGTERM)
    assert assert_left_well(tmp_path, children) == 0
    options = ("--renderer", "raycast", "--effort", QUICK, "--frames", "0:1")
    spin_usd("render", small_stage, "--out", tmp_path, *options)
    assert json.loads(spin_usd("check", tmp_path, "--json").stdout)["findings"] == []


def test_a_signal_stops_the_planning_and_leaves_nothing(small_stage, tmp_path) -> None:
    process = started(small_stage, tmp_path / "out", "--effort", QUICK)
    wait_until(lambda: children_of(process), process)
    children = children_of(process)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=STARTS_WITHIN_S)
    assert process.returncode == 128 + signal.SIGTERM
    assert not (tmp_path / "out").exists()
    assert not psutil.wait_procs(children, timeout=10)[1]


@pytest.mark.slow
def test_a_closed_terminal_neither_hangs_nor_loses_anything(small_stage, tmp_path) -> None:
    """The terminal goes for good: what the run still says there cannot be written."""
    ours, theirs = pty.openpty()
    terminal = {"stdin": theirs, "stdout": theirs, "stderr": theirs, "start_new_session": True}
    process = started(small_stage, tmp_path, "--effort", SLOW, **terminal)
    os.close(theirs)
    wait_until(lambda: begun(tmp_path), process)
    children = children_of(process)
    os.close(ours)
    process.send_signal(signal.SIGHUP)
    assert process.wait(timeout=STARTS_WITHIN_S) == 128 + signal.SIGHUP
    assert 1 <= assert_left_well(tmp_path, children) < 8

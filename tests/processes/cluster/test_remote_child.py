"""A worker behind an actor that is a thread: to a pool it is a child like any other."""

import importlib.util
import os
import re
import signal
import subprocess

import psutil
import pytest
from msgspec import to_builtins

from spin_usd.commands.render.calls import MAKE_PICTURE, OPEN_WORKER, MakePicture, OpenWorker
from spin_usd.errors import InputError
from spin_usd.picture.versions import library_versions
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.cluster.remote_child import LocalConnection, RemoteChild
from spin_usd.processes.cluster.worker_actor import WorkerOpening
from spin_usd.processes.cluster.worker_folder import SharedFolder
from spin_usd.processes.deaths import ChildDiedError, DeathCause
from spin_usd.processes.pool import Answered, Failed, Pool
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import Effort

pytestmark = pytest.mark.children


SEEN, TOKEN = "seen", "0123"


@pytest.fixture
def opening(tmp_path):
    """What an actor is opened with to start a worker that ray-casts, in a folder that it sees."""
    (tmp_path / SEEN).write_text(TOKEN)
    settings = RenderSettings(renderer="raycast", effort=Effort(), seed=0)
    options = WorkerOptions(root="", work="", stage="none.usda", settings=settings)
    output = SharedFolder(root=str(tmp_path), work=str(tmp_path), seen=SEEN, token=TOKEN)
    return WorkerOpening(
        output=output,
        call=OPEN_WORKER,
        request=to_builtins(OpenWorker(options=options)),
        versions=library_versions(),
        number=0,
    )


def first_event(opening):
    """Open the actor in a pool; returns the pool's first event, and the children that are left while it is open."""
    before = set(psutil.Process().children())
    with Pool[str]() as pool:
        pool.add("one", RemoteChild(LocalConnection(opening)), within_s=60)
        while not (events := list(pool.wait())):
            pass
        started = set(psutil.Process().children()) - before
    return events[0], started


def test_it_opens_a_worker_and_ends_with_the_pool(opening) -> None:
    event, started = first_event(opening)
    assert isinstance(event, Answered)
    assert "embreex" in event.result
    assert not [child for child in started if child.is_running() and child.status() != psutil.STATUS_ZOMBIE]


def test_another_folder_under_the_same_path_is_refused(opening, tmp_path) -> None:
    (tmp_path / SEEN).write_text("another")
    event, started = first_event(opening)
    assert isinstance(event, Failed)
    assert isinstance(event.reason, InputError)
    assert "is not the same folder on the node" in str(event.reason)
    assert not started


def test_a_machine_with_other_software_is_refused(opening) -> None:
    event, _ = first_event(WorkerOpening(**{**vars(opening), "versions": {"python": "2.7"}}))
    assert "has python" in str(event.reason)
    assert "the machine that plans has 2.7" in str(event.reason)


def test_its_death_is_an_event_with_its_cause(opening) -> None:
    before = set(psutil.Process().children())
    with Pool[str]() as pool:
        pool.add("one", RemoteChild(LocalConnection(opening)), within_s=60)
        while not list(pool.wait()):
            pass
        (worker,) = set(psutil.Process().children()) - before
        pool.send("one", MAKE_PICTURE, MakePicture(variant="", index=0, kinds=()), within_s=60)
        os.kill(worker.pid, signal.SIGKILL)
        reasons = []
        while len(pool):
            reasons += [event.reason for event in pool.wait()]
    assert isinstance(reasons[-1], ChildDiedError)
    assert reasons[-1].cause is DeathCause.KILLED


def test_neither_ray_nor_fsspec_is_loaded_without_need(python) -> None:
    """In the environment that has both: what the command line and a render import."""
    imported = "spin_usd.command_line, spin_usd.commands.render.run"
    code = f"import sys, {imported}; print({{'ray', 'fsspec'}} & set(sys.modules))"
    done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.slow
def test_files_at_urls_in_the_environment_that_has_fsspec(python) -> None:
    tests = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "tests/store/publish"]
    done = subprocess.run([python, *tests], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert "skipped" not in done.stdout


@pytest.mark.skipif(importlib.util.find_spec("ray") is not None, reason="Ray is installed")
def test_without_ray_the_command_says_what_to_install(small_stage, tmp_path, spin_usd) -> None:
    done = spin_usd("render", small_stage, "--out", tmp_path / "out", "--cluster", "auto", code=2)
    assert re.search(
        r"render --cluster or --out URL needs .*ray, which .* not installed; run .*pip install .*'ray", done.stderr
    )
    assert not (tmp_path / "out").exists()


def test_a_shard_on_a_cluster_is_refused_whatever_is_installed(small_stage, tmp_path, spin_usd) -> None:
    done = spin_usd("render", small_stage, "--out", tmp_path / "out", "--cluster", "auto", "--shard", "0/2", code=2)
    assert "--shard and --cluster are given together; give one" in done.stderr

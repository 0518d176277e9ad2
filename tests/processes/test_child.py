import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil
import pytest

from spin_usd.commands.augment.run import PARAMETER_LIST
from spin_usd.errors import SpinError
from spin_usd.processes.call import Call
from spin_usd.processes.child import IN_PROCESS, Child, ChildInternalError
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.open_renderer import TRY_RENDERER
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.children


GONE_WITHIN_S = 10.0


def wait_until(condition, seconds=GONE_WITHIN_S):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


def test_an_error_in_the_child_is_the_same_error_here(tmp_path) -> None:
    with Child() as child, pytest.raises(SpinError) as raised:
        child.call(TRY_RENDERER, "povray")
    assert type(raised.value).__name__ == "InputError"
    assert "povray" in str(raised.value)


def test_a_defect_in_the_child_is_not_taken_for_bad_input() -> None:
    with Child() as child, pytest.raises(ChildInternalError):
        child.call(Call("no:such", str, str), "call")


def test_a_child_loads_modules_before_it_is_asked_and_outlives_one_that_is_not_there() -> None:
    with Child(modules=("spin_usd.no_such_module", "numpy")) as child:
        maps = f"/proc/{child.process.pid}/maps"
        assert sys.platform != "linux" or wait_until(lambda: "/numpy/" in Path(maps).read_text(encoding="utf-8"))
        assert child.call(PARAMETER_LIST, None)


def test_a_killed_child_is_reported_and_does_not_hang() -> None:
    with Child() as child:
        child.process.send_signal(signal.SIGKILL)
        with pytest.raises(ChildDiedError, match="SIGKILL"):
            child.call(TRY_RENDERER, "raycast")


def test_an_interrupted_child_is_left_to_the_thread_that_waits_for_it() -> None:
    with Child() as child:
        child.interrupt()
        assert wait_until(lambda: psutil.Process(child.process.pid).status() == psutil.STATUS_ZOMBIE)
        assert child.process.returncode is None
        with pytest.raises(ChildDiedError, match="SIGKILL"):
            child.call(TRY_RENDERER, "raycast")
        child.interrupt()


def test_a_child_ends_with_its_parent() -> None:
    """Also when the parent is killed and can say nothing."""
    code = (
        "import time; from spin_usd.processes.child import Child\n"
        "child = Child(); print(child.process.pid, flush=True); time.sleep(60)"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    assert psutil.pid_exists(pid)
    parent.kill()
    parent.wait()
    assert wait_until(lambda: not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)


def test_the_childs_environment_holds_nothing_that_could_change_a_picture(monkeypatch) -> None:
    for name in ("PXR_PLUGINPATH_NAME", "OCIO", "PYTHONPATH", "LD_PRELOAD", "OPENIMAGEIO_OPTIONS"):
        monkeypatch.setenv(name, os.devnull)
    with Child() as child:
        environment = psutil.Process(child.process.pid).environ()
    assert not {"PXR_PLUGINPATH_NAME", "OCIO", "PYTHONPATH", "LD_PRELOAD", "OPENIMAGEIO_OPTIONS"} & set(environment)


ASKING = """
from spin_usd.commands.augment.run import PARAMETER_LIST
from spin_usd.processes.ask_child import ask_child
print(len(ask_child(PARAMETER_LIST, None, reads="the list")))
"""


def test_a_child_whose_packages_lie_on_a_path_of_its_parent_says_how_it_gets_them() -> None:
    packages = [*filter(None, sys.path), str(REPOSITORY)]
    bare = {name: value for name, value in os.environ.items() if name != IN_PROCESS}
    bare["PYTHONPATH"] = os.pathsep.join(packages)
    run = [os.path.realpath(sys.executable), "-c", ASKING]  # without the packages of a virtual environment
    refused = subprocess.run(run, env=bare, capture_output=True, text=True)
    assert "the list: was not read: the worker process ended with exit status 1" in refused.stderr
    assert re.search("give children PYTHONPATH.* too: SPIN_USD_HAND_ON=PYTHONPATH", refused.stderr)
    found = subprocess.run(run, env=bare | {"SPIN_USD_HAND_ON": "PYTHONPATH"}, capture_output=True, text=True)
    assert int(found.stdout) > 10, found.stderr


def test_what_libraries_print_does_not_reach_the_answers() -> None:
    with Child() as child:
        assert "blender" in child.call(TRY_RENDERER, "blender")


def test_answers_that_arrive_together_are_reported_one_by_one() -> None:
    with Child() as child:
        for _ in range(2):
            child.send(TRY_RENDERER, "raycast")
        time.sleep(2.0)  # both answers wait in the pipe
        for _ in range(2):
            assert "embreex" in child.receive(within_s=5.0)["result"]


def test_what_a_child_leaves_that_crashes_is_gone_with_it(tmp_path, monkeypatch) -> None:
    """USD writes a file about its crash into the folder of temporary files."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with Child() as child:
        (folder,) = tmp_path.iterdir()
        (folder / "st_python").write_text("stack")
        os.kill(child.process.pid, signal.SIGSEGV)
        with pytest.raises(ChildDiedError):
            child.call(TRY_RENDERER, "raycast")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux bounds a child's memory")
@pytest.mark.parametrize(("memory", "cause"), [(6 << 30, "crashed"), (10 << 20, "grew")])
def test_a_crash_of_a_child_that_held_most_of_its_memory_is_told_from_others(memory, cause) -> None:
    """What is read takes all memory again if it is tried again."""
    with Child() as child:
        child._memory = memory
        child.call(TRY_RENDERER, "raycast")
        os.kill(child.process.pid, signal.SIGSEGV)
        with pytest.raises(ChildDiedError) as died:
            child.receive()
    assert died.value.cause == cause

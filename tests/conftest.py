"""What several test files need: the command line as a user has it, real inputs, and a small authored stage."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import hypothesis
import pytest

from spin_usd.basics.stop_signals import STOP_SIGNALS
from spin_usd.command_line import run as run_console_script
from spin_usd.planning.machine_speed import TRIAL_S, keep_trial
from spin_usd.processes.child import IN_PROCESS
from spin_usd.processes.processors import hold_to, share_of
from spin_usd.store.json_schema import valid
from tests.library import library_of

# No deadlines: machines are shared. The same examples in every run: a failure is a failure, not luck.
hypothesis.settings.register_profile("steady", deadline=None, derandomize=True)
hypothesis.settings.load_profile("steady")

REPOSITORY = Path(__file__).resolve().parent.parent
SHARED = REPOSITORY.parent / "shared"
EXAMPLE_POSES = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"
CUBESAT_NEARER = 0.17
"""How much nearer the CubeSat is in the small stage than Tango in the examples' poses: it is smaller by as much."""
REPORTS = {"check", "diff", "doctor", "evidence", "gap", "plan", "render", "score"}
"""Commands whose --json has a schema."""


def pytest_configure(config) -> None:
    """Give each of several test processes its share of the processors, so that what they start does not compete; and
    let signals do what they do in a terminal: whatever a script starts in the background ignores some."""
    for number in STOP_SIGNALS:
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    os.environ[IN_PROCESS] = "1"
    ours = getattr(config, "workerinput", None)  # of pytest-xdist
    if ours is not None:
        hold_to(share_of(int(ours["workerid"].removeprefix("gw")), ours["workercount"]))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Keep the tests' files as pytest has compiled them, also where PYTHONDONTWRITEBYTECODE says otherwise: without,
    each process of each run rewrites the assertions of 400 files, which takes six seconds."""
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, False
    try:
        return (yield)
    finally:
        sys.dont_write_bytecode = before


@pytest.fixture(autouse=True)
def children(request, monkeypatch) -> None:
    """Let commands start child processes as users' do in tests marked so; elsewhere what a child does is done in the
    test's own process, which has loaded what it needs: a third of the time."""
    if request.node.get_closest_marker("children"):
        monkeypatch.delenv(IN_PROCESS)


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory) -> Iterator[None]:
    """Keep what commands remember of the machine out of the user's own cache folder, and let it be there, so that
    none tries how fast it is; fonts stay where they are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MPLCONFIGDIR", os.environ.get("MPLCONFIGDIR", str(Path.home() / ".cache" / "matplotlib")))
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        keep_trial(TRIAL_S)
        yield


@pytest.fixture(scope="session")
def shared():
    """The folder of real inputs beside the repository; tests that want it are skipped where it is not."""
    if not (SHARED / "data").is_dir():
        pytest.skip("no ../shared with real inputs")
    return SHARED


@pytest.fixture(scope="session")
def spin_usd():
    """Run `spin-usd ARGUMENTS...` as the console script does; returns what a process would: returncode, stdout, stderr.

    It runs in this process, whose imports are made already: half of what a process of its own takes. Its children are
    processes as ever. Tests of signals, and of what a terminal or an environment changes, start processes themselves.
    What a report prints with --json is held to its schema.
    """

    def run(*arguments, code=0, cwd=None):
        with pytest.MonkeyPatch.context() as patch, StringIO() as out, StringIO() as err:
            patch.setattr(sys, "argv", ["spin-usd", *map(str, arguments)])
            patch.setenv("COLUMNS", "120")
            patch.chdir(cwd or Path.cwd())
            before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
            try:
                with redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as ended:
                    run_console_script()
            finally:
                for number, handler in before.items():
                    signal.signal(number, handler)
            done = subprocess.CompletedProcess(sys.argv, ended.value.code, out.getvalue(), err.getvalue())
        assert done.returncode == code, f"exit {done.returncode}, expected {code}\n{done.stdout}\n{done.stderr}"
        if "--json" in arguments and arguments[0] in REPORTS and done.stdout:
            valid(done.stdout.encode(), f"{arguments[0]}-report-1", Path("standard output"))
        return done

    return run


@pytest.fixture(scope="session")
def blenders():
    """Those that this process has opened; the last is the one that may be open."""
    opened: list[Any] = []
    yield opened
    for renderer in opened:
        renderer.close()


@pytest.fixture(scope="module")
def blender(blenders):
    """The one Blender of this process, opened again where a command of a module before has opened another."""
    from spin_usd.renderers.blender.renderer import BlenderRenderer

    if not blenders or not _is_open(blenders[-1]):
        blenders.append(BlenderRenderer())
    return blenders[-1]


def _is_open(renderer) -> bool:
    try:
        return bool(renderer._scene.name)
    except ReferenceError:
        return False


@pytest.fixture(scope="session")
def browser():
    """The one headless Chromium of this process; without one on PATH the test is skipped."""
    from tests.cases.chromium import NoChromiumError, headless_chromium

    try:
        with headless_chromium() as chromium:
            yield chromium
    except NoChromiumError as lacking:
        pytest.skip(str(lacking))


def speedplus_camera(divide=1):
    """SPEED+'s camera.json with an image smaller by the whole number `divide`; the same field of view and lens."""
    k = 1 / divide
    return {
        "Nu": 1920 // divide,
        "Nv": 1200 // divide,
        "ppx": 5.86e-6 / k,
        "ppy": 5.86e-6 / k,
        "fx": 0.0176,
        "fy": 0.0176,
        "ccx": 960 * k,
        "ccy": 600 * k,
        "cameraMatrix": [[2988.5795163815555 * k, 0, 960 * k], [0, 2988.3401159176124 * k, 600 * k], [0, 0, 1]],
        "distCoeffs": [
            -0.22383016606510672,
            0.51409797089106379,
            -0.00066499611998340662,
            -0.00021404771667484594,
            -0.13124227429077406,
        ],
    }


@pytest.fixture(scope="session")
def library(request, tmp_path_factory):
    """Small stages and datasets, each made once a run: see tests/library.py."""
    return library_of(tmp_path_factory, shared=hasattr(request.config, "workerinput"))


@pytest.fixture(scope="session")
def small_stage(library, spin_usd):
    """A stage of eight pictures of the CubeSat at 240 x 150 with SPEED+'s lens: the path of its root layer. Tango takes
    twice as long to author and render, and eight times as long to check. The CubeSat is as large in its pictures."""

    def make(folder):
        poses = json.loads(EXAMPLE_POSES.read_text())
        for pose in poses:
            pose["r_Vo2To_vbs_true"] = [CUBESAT_NEARER * metres for metres in pose["r_Vo2To_vbs_true"]]
        (folder / "poses.json").write_text(json.dumps(poses))
        _author_small(spin_usd, folder, folder / "poses.json", "cubesat")

    return library.folder("small", make) / "stage" / "dataset.usda"


@pytest.fixture(scope="session")
def small_tango_stage(library, spin_usd):
    """A stage of eight pictures of Tango at 240 x 150 with SPEED+'s lens: the path of its root layer."""
    made = library.folder("small_tango", lambda folder: _author_small(spin_usd, folder, EXAMPLE_POSES, "tango"))
    return made / "stage" / "dataset.usda"


def _author_small(spin_usd, folder, poses, target) -> None:
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=8)))
    spin_usd("author", "--poses", poses, "--target", target, "--camera", folder / "camera.json",
             "--out", folder / "stage")  # fmt: skip


@pytest.fixture(scope="session")
def cubesat_stage(library, spin_usd):
    """A stage of three pictures of the CubeSat by SPEED+'s camera: the path of its root layer."""

    def make(folder):
        spin_usd("author", "--poses", EXAMPLE_POSES, "--target", "cubesat", "--camera", "speedplus",
                 "--frames", "0:3", "--out", folder / "stage")  # fmt: skip

    return library.folder("cubesat", make) / "stage" / "dataset.usda"


@pytest.fixture(scope="session")
def rendered(library, small_stage, spin_usd):
    """The folder of a dataset of three pictures of the CubeSat at 240 x 150, with radiance."""
    return library.folder("rendered", lambda folder: _render_three(spin_usd, small_stage, folder)) / "dataset"


@pytest.fixture(scope="session")
def rendered_tango(library, small_tango_stage, spin_usd):
    """The folder of a dataset of three pictures of Tango at 240 x 150, with radiance."""
    made = library.folder("rendered_tango", lambda folder: _render_three(spin_usd, small_tango_stage, folder))
    return made / "dataset"


def _render_three(spin_usd, stage, folder) -> None:
    spin_usd("render", stage, "--out", folder / "dataset", "--renderer", "raycast", "--frames", "0:3",
             "--radiance")  # fmt: skip


@pytest.fixture(scope="session")
def foreign_sets(library, spin_usd):
    """A dataset in the layouts of others: see tests/cases/foreign_sets.py."""
    from tests.cases.foreign_sets import ForeignSets  # not above: copies of this file alone are made

    return ForeignSets(library, spin_usd)


@pytest.fixture(scope="session")
def skyfield_loader():
    """Another library's view of the sky: Skyfield with the files that travel with skyfield-data."""
    from skyfield.api import Loader
    from skyfield_data import get_skyfield_data_path

    return Loader(get_skyfield_data_path(), expire=False)


@pytest.fixture(scope="session")
def timescale(skyfield_loader):
    """Its times."""
    return skyfield_loader.timescale(builtin=True)


@pytest.fixture(scope="session")
def de421(skyfield_loader):
    """JPL's ephemeris DE421."""
    return skyfield_loader("de421.bsp")

"""Reading a dataset and scoring predictions need nothing that Linux alone has.

No other system is at hand: what Windows and macOS lack is hidden from a Python of its own.
"""

import csv
import json
import subprocess
import sys

import pytest

from spin_usd import Dataset
from spin_usd.basics.extras import EXTRAS
from tests.conftest import REPOSITORY

MODULES = ("fcntl", "resource", "pwd", "grp", "termios", "pty")
SIGNALS = ("SIGHUP", "SIGKILL", "SIGSTOP")
NAMES = ("O_NOFOLLOW", "O_NONBLOCK", "O_DIRECTORY", "O_CLOEXEC", "killpg", "sysconf", "geteuid", "getuid", "wait4")
HIDE = f"""
import sys, os, signal
for name in {MODULES}:
    sys.modules[name] = None
for name in {NAMES}:
    delattr(os, name)
for name in {SIGNALS}:
    delattr(signal, name)
os.supports_dir_fd.clear()
os.supports_fd.clear()
for name in sys.argv.pop(1).split(","):
    sys.modules[name] = None
"""
READ = """
import json, spin_usd
dataset = spin_usd.Dataset(sys.argv[1])
picture = dataset[0]
assert picture.image.any() and picture.segmentation.any() and picture.dense_pose[picture.depth > 0].any()
crops = dataset.where("visible > 0").crop("cubesat", 32)
assert dataset.collate([*crops], labels=["image", "depth"])["depth"].shape == (len(dataset), 32, 32)
"""
EXCHANGE = """
import importlib, pkgutil, spin_usd.exchange
for module in pkgutil.walk_packages(spin_usd.exchange.__path__, "spin_usd.exchange."):
    importlib.import_module(module.name)
from spin_usd.exchange.read_pose_list import read_pose_list
"""
COMMAND = "from spin_usd.__main__ import run; run()"
SCORE = """
import spin_usd, json
report = spin_usd.score(sys.argv[2], truth=sys.argv[1])
print(json.dumps([report.all.pictures, report.all.position_m["mean"], report.notes]))
"""


def run(code: str, hidden: str, *arguments: object) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-c", HIDE + code, hidden or "nothing", *map(str, arguments)]
    return subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True)


@pytest.fixture(scope="module")
def predictions(rendered, tmp_path_factory):
    """Poses as they are, but 1 m further away."""
    file = tmp_path_factory.mktemp("predictions") / "predictions.csv"
    with file.open("w", newline="") as stream:
        rows = csv.writer(stream)
        rows.writerow(("filename", "qw", "qx", "qy", "qz", "x", "y", "z"))
        for picture in Dataset(rendered):
            pose = picture.record["pose"]
            x, y, z = pose["t_cam_body"]
            rows.writerow((picture.frame, *pose["q_cam_body"], x, y, z + 1))
    return file


@pytest.mark.parametrize("hidden", ["", ",".join(EXTRAS["render"].packages)], ids=["render", "read"])
def test_a_dataset_is_read(rendered, hidden) -> None:
    done = run(READ, hidden, rendered)
    assert done.returncode == 0, done.stderr


def test_every_format_is_imported() -> None:
    done = run(EXCHANGE, "", "")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("hidden", ["", ",".join(EXTRAS["render"].packages)], ids=["render", "read"])
def test_predictions_are_scored_without_the_targets_points(rendered, predictions, hidden) -> None:
    done = run(SCORE, hidden, rendered, predictions)
    assert done.returncode == 0, done.stderr
    pictures, off, notes = json.loads(done.stdout)
    assert pictures == len(Dataset(rendered))
    assert off == pytest.approx(1)
    (said,) = [note for note in notes if note.startswith("ADD and BOP's recalls")]
    assert "this system has no resource" in said


def test_the_command_scores_too(rendered, predictions) -> None:
    done = run(COMMAND, "", "score", predictions, "--truth", rendered, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["all"]["position_m"]["mean"] == pytest.approx(1)


@pytest.mark.parametrize("name", ["author", "export", "render"])
def test_what_needs_linux_says_so(name) -> None:
    code = f"import spin_usd\ntry: spin_usd.{name}\nexcept spin_usd.SpinError as error: print(error)"
    said = run(code, "").stdout
    assert said.startswith("this system has no ")
    assert said.endswith("; read datasets and score predictions here, and do all else on Linux\n")

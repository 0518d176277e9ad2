"""An experiment goes on where it was killed, and its finished rows are not done again."""

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time

import pytest

from tests.conftest import REPOSITORY, speedplus_camera
from tests.train.conftest import PYTHON

pytestmark = [pytest.mark.slow, pytest.mark.children, pytest.mark.usefixtures("baseline")]

SPEC = """
tests = ["other"]
seeds = [0, 1]

[training]
steps = 3
batch = 4
size = 64
width = 8
decoder = 16

[set.own]
author = { sample = "range=3..5 inside=1 count=4", target = "tango", camera = "camera.json", materials = "all.csv" }
render = { renderer = "raycast", labels = "none" }

[set.other]
author = { sample = "range=3..5 inside=1 count=2", seed = 1, target = "tango", camera = "camera.json" }
render = { renderer = "raycast", labels = "none" }

[row.all]
set = ["own", "other"]
"""
MEASURED = ("render_cpu_s", "train_cpu_s", "machine", "finished")


def start(folder, work, *options):
    command = [sys.executable, "-m", "train.experiment", folder / "tiny.toml", "--work", folder / work]
    command += ["--figures", folder / f"{work}_figures", "--jobs", "1", *options]
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY / "tools")}
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True, start_new_session=True)


def rows(folder, work):
    found = {file.name: json.loads(file.read_text()) for file in (folder / f"{work}_figures" / "tiny").glob("*.json")}
    return {name: {key: row[key] for key in row if key not in MEASURED} for name, row in found.items()}


@pytest.fixture(autouse=True)
def _files(tmp_path) -> None:
    (tmp_path / "tiny.toml").write_text(SPEC)
    (tmp_path / "all.csv").write_text("pattern,material\n*,white_paint\n")
    (tmp_path / "camera.json").write_text(json.dumps(speedplus_camera(divide=10)))


@pytest.mark.timeout(600)
def test_a_killed_experiment_makes_the_same_table(tmp_path) -> None:
    whole = start(tmp_path, "whole")
    assert "row all, seed 1: 2 of 2" in whole.communicate()[0]
    assert whole.returncode == 0
    for moment in ("sets/*/seconds.json", "sets/*/rendered", "rows/all-*/0/log.txt"):
        process = start(tmp_path, "killed")
        while process.poll() is None and not list((tmp_path / "killed").glob(moment)):
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
    again = start(tmp_path, "killed")
    assert again.communicate()[0]
    assert again.returncode == 0
    assert rows(tmp_path, "killed") == rows(tmp_path, "whole")
    third = start(tmp_path, "killed")
    assert "2 of 2 are finished" in third.communicate()[0]


@pytest.mark.timeout(600)
def test_rows_learned_from_packs_are_scored(tmp_path) -> None:
    """What another machine has learned is taken as it is, and is the same there."""
    whole = start(tmp_path, "whole")
    assert whole.communicate()[0]
    packs = tmp_path / "packs"
    assert start(tmp_path, "packed", "--packs", packs).wait() == 0
    environment = os.environ | {"PYTHONPATH": f"{REPOSITORY / 'tools'}:{REPOSITORY}"}
    for line in (packs / "commands.txt").read_text().splitlines():
        subprocess.run([PYTHON, *shlex.split(line)[1:]], cwd=packs, env=environment, check=True)
    shutil.copytree(packs / "rows", tmp_path / "packed" / "rows")
    assert start(tmp_path, "packed").wait() == 0
    assert rows(tmp_path, "packed") == rows(tmp_path, "whole")
    assert not list((tmp_path / "packed" / "rows").glob("*/*/log.txt"))

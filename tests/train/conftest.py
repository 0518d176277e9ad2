"""tools/train as its users run it: its modules, and the environment that it trains in."""

import json
import os
import subprocess

import pytest

from tests.conftest import REPOSITORY, speedplus_camera

PYTHON = REPOSITORY / ".venv-train" / "bin" / "python"
TINY = ("--size", "64", "--width", "8", "--decoder", "16", "--batch", "16", "--no-jitter")


@pytest.fixture(autouse=True)
def _tools(monkeypatch) -> None:
    monkeypatch.syspath_prepend(REPOSITORY / "tools")


@pytest.fixture(scope="session")
def baseline():
    """Run `tools/train/baseline ARGUMENTS...` in its environment; skipped where it is not."""
    if not PYTHON.is_file():
        pytest.skip("no .venv-train; tools/train_environment makes it")

    def run(*arguments, **others):
        command = [PYTHON, "-m", "train.baseline", *map(str, arguments)]
        environment = os.environ | {"PYTHONPATH": str(REPOSITORY / "tools")}
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True, **others)

    return run


@pytest.fixture(scope="session")
def tango(tmp_path_factory, spin_usd):
    """The folder of a dataset of sixteen raycast pictures of Tango in 192 x 120 pixels."""
    folder = tmp_path_factory.mktemp("tango")
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=10)))
    poses = ("--sample", "range=3..5 attitude=0.36,0.48,0.64,0.48:45 inside=1 count=16", "--target", "tango")
    spin_usd("author", *poses, "--camera", folder / "camera.json", "--out", folder / "stage")
    spin_usd("render", folder / "stage", "--out", folder / "dataset", "--renderer", "raycast", "--labels", "none")
    return folder / "dataset"

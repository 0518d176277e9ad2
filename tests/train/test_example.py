"""docs/train_pytorch.py and train_events.py as they stand: the networks learn."""

import re
import subprocess

import pytest

from tests.conftest import REPOSITORY
from tests.train.conftest import PYTHON


@pytest.mark.slow
def test_the_example_of_pytorch_learns(tmp_path) -> None:
    if not PYTHON.is_file():
        pytest.skip("no .venv-train; tools/train_environment makes it")
    command = [PYTHON, REPOSITORY / "docs" / "train_pytorch.py", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    off = [float(number) for number in re.findall(r"are (\S+) pixels off", done.stdout)]
    assert len(off) == 3
    assert off[-1] < off[0] / 3


@pytest.mark.slow
def test_the_example_of_events_learns(tmp_path) -> None:
    if not PYTHON.is_file() or subprocess.run([PYTHON, "-c", "import h5py"], check=False).returncode:
        pytest.skip("no .venv-train with h5py; tools/train_environment makes it")
    command = [PYTHON, REPOSITORY / "docs" / "train_events.py", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    off = [float(number) for number in re.findall(r"is (\S+) m off", done.stdout)]
    assert len(off) == 5
    assert off[-1] < off[0] / 2

"""tools/try_kills and tools/try_limits: short trials, of which all holds, and a fault is told."""

import shutil
import subprocess
import sys

import pytest

from tests.conftest import REPOSITORY

sys.path.insert(0, str(REPOSITORY / "tools"))
from run_trials.comparison import digests, faults


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_short_trial_of_kills(tmp_path) -> None:
    command = [sys.executable, REPOSITORY / "tools" / "try_kills.py", "--out", tmp_path / "out", "--pictures", "10"]
    options = ["--kills", "3", "--supervisor-kills", "1", "--stops", "1", "--picture-timeout", "5"]
    done = subprocess.run(list(map(str, command + options)), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "| did not hold | 0 |" in done.stdout
    whole = tmp_path / "out" / "whole"
    before, other = digests(whole), shutil.copytree(whole, tmp_path / "other")
    assert list(faults(other, before, pictures=10)) == []
    next((other / "image" / "nominal").iterdir()).write_bytes(b"torn")
    (other / ".work-x").mkdir()
    next((other / "records" / "nominal").iterdir()).unlink()
    assert len(list(faults(other, before, pictures=10))) >= 4


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_short_trial_of_limits(tmp_path) -> None:
    command = [sys.executable, REPOSITORY / "tools" / "try_limits.py", "--out", tmp_path / "out", "--full-disks", "2"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "| did not hold | 0 |" in done.stdout
    assert "| the second of two: exit code" in done.stdout

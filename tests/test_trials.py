"""tools/try_kills and tools/try_memory: a short trial, of which all holds, a fault is told, and a leak is."""

import shutil
import subprocess
import sys

import pytest

from tests.conftest import REPOSITORY

sys.path.insert(0, str(REPOSITORY / "tools"))
from trials import digests, faults
from try_memory import MemorySample, in_csv, slope

pytestmark = pytest.mark.children


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_a_short_trial_of_kills_and_limits(tmp_path) -> None:
    command = [sys.executable, REPOSITORY / "tools" / "try_kills.py", "--out", tmp_path / "out", "--pictures", "10"]
    options = ["--kills", "3", "--supervisor-kills", "1", "--stops", "1", "--picture-timeout", "5", "--full-disks", "2"]
    options += ["--power-cuts", "1"]
    done = subprocess.run(list(map(str, command + options)), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "| did not hold | 0 |" in done.stdout
    assert "| the second of two: exit code" in done.stdout
    whole = tmp_path / "out" / "whole"
    before, other = digests(whole), shutil.copytree(whole, tmp_path / "other")
    assert list(faults(other, before, pictures=10)) == []
    next((other / "image" / "nominal").iterdir()).write_bytes(b"torn")
    (other / ".work-x").mkdir()
    next((other / "records" / "nominal").iterdir()).unlink()
    assert len(list(faults(other, before, pictures=10))) >= 4


def test_a_leak_is_told_in_mb_for_1000_pictures() -> None:
    """What is kept at the start is none."""
    start = [MemorySample(pictures=n, supervisor=50.0, worker=100.0 + n) for n in range(1, 100)]
    later = [MemorySample(pictures=n, supervisor=50.0, worker=200.0 + 0.005 * n) for n in range(250, 1001, 10)]
    assert slope([*start, *later], "worker") == pytest.approx(5.0)
    assert slope([*start, *later], "supervisor") == pytest.approx(0.0, abs=1e-9)
    assert in_csv(later).splitlines()[:2] == ["pictures,supervisor_MB,worker_MB", "250,50.0,201.2"]

"""The slope that tools/try_memory tells is that of the samples."""

import sys

import pytest

from tests.conftest import REPOSITORY

sys.path.insert(0, str(REPOSITORY / "tools"))
from run_trials.memory import MemorySample, in_csv, slope


def test_a_leak_is_told_in_mb_for_1000_pictures() -> None:
    """What is kept at the start is none."""
    start = [MemorySample(pictures=n, supervisor=50.0, worker=100.0 + n) for n in range(1, 100)]
    later = [MemorySample(pictures=n, supervisor=50.0, worker=200.0 + 0.005 * n) for n in range(250, 1001, 10)]
    assert slope([*start, *later], "worker") == pytest.approx(5.0)
    assert slope([*start, *later], "supervisor") == pytest.approx(0.0, abs=1e-9)
    assert in_csv(later).splitlines()[:2] == ["pictures,supervisor_MB,worker_MB", "250,50.0,201.2"]

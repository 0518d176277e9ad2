"""tools/simulate_cluster on a small stage: no run ends before the ideal."""

import json
import subprocess
import sys

import pytest

from tests.conftest import REPOSITORY


def simulated(stage, *options):
    command = [sys.executable, REPOSITORY / "tools" / "simulate_cluster.py", stage, "--renderer", "raycast", "--json"]
    done = subprocess.run([*command, *map(str, options)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.campaign
def test_each_frame_stands_for_as_many_as_were_left_out(small_stage) -> None:
    found = simulated(small_stage, "--every", 2, "--shards", 2, 4, "--machines", 2, "--spread", 0, 0)
    assert (found["pictures"], found["renders"]) == (8, 8)
    assert 3600 * found["core_hours"] == pytest.approx(found["ideal_s"] * 2 * found["workers"])
    for each in found["shards"]:
        assert each["alike_s"] == each["seconds"] > found["ideal_s"] + each["planning_s"]
    assert found["queue_s"] > found["ideal_s"] + found["planning_s"]

"""tools/bench as the one who makes the documents' figures runs it, with its smallest sizes."""

import json
import os
import subprocess
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY

NUMBER = (int, float)
(OCIO,) = Path(find_spec("bpy").origin).parent.glob("*/datafiles/colormanagement/config.ocio")


def bench(name, *arguments):
    """Where OCIO is set, as by a Blender that was imported, Blender prints more than it usually does."""
    command = [REPOSITORY / "tools" / "bench", name, "--quick", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "OCIO": str(OCIO)})
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.timeout(900)  # four benchmarks, which other tests slow down
def test_the_quick_run_puts_all_figures_into_one_file(tmp_path) -> None:
    file = tmp_path / "bench.json"
    for name in ("frames", "growth", "plan", "predict"):
        assert "|" in bench(name, "--json", file)
    found = json.loads(file.read_text())
    assert set(found) == {"frames", "growth", "plan", "predict"}
    for figures in found.values():
        assert figures["machine"]["cores"] > 0
        assert set(figures["machine"]) == {"architecture", "cores", "memory_gib", "system", "versions"}
    frames = found["frames"]["makers"]
    assert "spin_usd, image and labels" in frames
    plain = any("plain bpy script" in each for each in found["frames"]["left_out"])
    assert plain is not ("plain bpy script, full frame" in frames)  # made, or said why not
    for maker in frames.values():
        for spread in (maker["wall_s"], maker["over_ours"]):
            assert 0 < spread["least"] <= spread["median"] <= spread["most"]
    for sweep in found["growth"]["sweeps"].values():
        assert len(sweep["rows"]) > 1
        assert all(isinstance(sweep["cpu"][name], NUMBER) for name in ("slope", "intercept", "off"))
    assert {row["prims"] for row in found["plan"]["cases"]} > {0}
    assert all(case["predicted_over_taken"] > 0 for case in found["predict"]["cases"])

"""tools/try_files: the outcome of each model is told, and sizes by two readers stand beside one another."""

import json
import subprocess
import sys

import pytest
import trimesh

from tests.conftest import REPOSITORY

USD = """#usda 1.0
(
    defaultPrim = "Model"
    metersPerUnit = 0.01
    upAxis = "Y"
)
def Xform "Model"
{
    def Cube "Block"
    {
        double size = 60
        double3 xformOp:translate = (0, 10, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
"""


def try_files(models, out, *more):
    command = [sys.executable, REPOSITORY / "tools" / "try_files.py", models, "--out", out, *more]
    command += ["--command", REPOSITORY / ".venv" / "bin" / "spin-usd"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    outcomes = {f.stem: json.loads(f.read_text()) for f in (out / "outcomes").glob("*.json")}
    return done.stdout, {name.partition("__")[2]: outcome for name, outcome in outcomes.items()}


@pytest.mark.campaign
@pytest.mark.timeout(600)
def test_sizes_by_two_readers_agree(tmp_path) -> None:
    models = tmp_path / "models"
    models.mkdir()
    trimesh.creation.box((0.3, 0.2, 0.5)).export(models / "box.obj")
    (models / "block.usda").write_text(USD)
    (models / "broken.stl").write_bytes(b"solid nothing")
    table, outcomes = try_files(models, tmp_path / "out")
    assert table.count("\n") >= 2 + len(outcomes) == 5
    for name, sides in (("box.obj", (0.3, 0.2, 0.5)), ("block.usda", (0.6, 0.6, 0.6))):
        found = outcomes[name]
        assert found["render"]["exit"] == 0
        for low, high in (found["ours"], found["source"]):
            assert [b - a for a, b in zip(low, high, strict=True)] == pytest.approx(sides, rel=1e-5)
    assert outcomes["broken.stl"]["author"]["exit"] == 2
    assert "source_error" in outcomes["broken.stl"]

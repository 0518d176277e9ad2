"""tools/bench as the one who makes the documents' figures runs it, with its smallest sizes."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from spin_usd.dataset.process.processors import usable_cpus
from spin_usd.labels.table import PIXEL_LABELS
from tests.conftest import REPOSITORY

(OCIO,) = Path(find_spec("bpy").origin).parent.glob("*/datafiles/colormanagement/config.ocio")


def bench(name, *arguments):
    """Where OCIO is set, as by a Blender that was imported, Blender prints more than it usually does."""
    command = [sys.executable, REPOSITORY / "tools" / "bench.py", name, "--quick", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "OCIO": str(OCIO)})
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The figures of quick runs, all in one file."""
    file = tmp_path_factory.mktemp("bench") / "bench.json"
    arguments = {"growth": ("--sweeps", "pictures")}
    for name in ("frames", "growth", "labels", "plan", "predict"):
        assert bench(name, *arguments.get(name, ()), "--json", file).count("|") > 10
    return json.loads(file.read_text())


@pytest.mark.slow
def test_each_says_on_what_machine_it_was_run(found) -> None:
    assert set(found) == {"frames", "growth", "labels", "plan", "predict"}
    for name, figures in found.items():
        assert figures["machine"]["cores"] == (1 if name == "labels" else len(usable_cpus()))
        assert set(figures["machine"]) == {"architecture", "cores", "memory_gib", "system", "versions"}


@pytest.mark.slow
def test_makers_of_the_same_pictures_are_held_against_ours(found) -> None:
    """Picture by picture, every ratio is that of its seconds to ours."""
    figures, makers = found["frames"], found["frames"]["makers"]
    ours = figures["seconds"]["spin_usd, image and labels"]
    assert len(ours) == figures["pictures"] == 2
    assert "spin_usd, labels only (raycast)" in makers
    for name, maker in makers.items():
        seconds = figures["seconds"][name]
        ratios = [each / own for each, own in zip(seconds, ours, strict=True)]
        assert maker["wall_s"]["least"] == min(seconds)
        assert min(seconds) > 0
        assert maker["over_ours"]["least"] == pytest.approx(min(ratios), rel=1e-3)
        assert maker["over_ours"]["most"] == pytest.approx(max(ratios), rel=1e-3)
        assert maker["total_over_ours"] == pytest.approx(sum(seconds) / sum(ours), abs=2e-3)
    assert ("plain bpy script, full frame" in makers) != ("plain bpy script, full frame" in figures["left_out"])


@pytest.mark.slow
def test_growth_is_a_line_through_the_seconds(found) -> None:
    """Of two numbers of pictures it goes through both."""
    (sweep,) = found["growth"]["sweeps"].values()
    assert [row["pictures"] for row in sweep["rows"]] == [1, 2]
    for row in sweep["rows"]:
        line = sweep["cpu"]["slope"] * row["pictures"] + sweep["cpu"]["intercept"]
        assert row["cpu_s"]["median"] == pytest.approx(line, rel=2e-3)


@pytest.mark.slow
def test_plans_are_of_pictures_variants_and_prims(found) -> None:
    cases = [(row["frames"], row["variants"], row["prims"]) for row in found["plan"]["cases"]]
    assert cases == [(8, 1, 0), (8, 2, 0), (8, 1, 100)]


@pytest.mark.slow
def test_predictions_are_held_against_what_was_taken(found) -> None:
    (case,) = found["predict"]["cases"]
    assert case["predicted_over_taken"] == pytest.approx(case["predicted_s"] / case["taken_s"]["median"], rel=0.02)
    assert sum(each["median"] for each in case["work"].values()) == pytest.approx(case["work_s"]["median"], abs=0.01)
    assert 0 < case["work_s"]["median"] < case["taken_s"]["median"]


@pytest.mark.slow
def test_every_label_has_its_cost(found) -> None:
    """Of one picture each, they are less than all together."""
    figures = found["labels"]
    assert set(PIXEL_LABELS) < set(figures["seconds"])
    assert sum(each["least"] for each in figures["seconds"].values()) <= figures["in_all"]["least"] + 1e-3

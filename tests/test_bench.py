"""tools/bench as the one who makes the documents' figures runs it, with its smallest sizes."""

import importlib
import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spin_usd.accuracy.error import FLOOR
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.processes.processors import usable_cpus
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.children

MEASURED = ("device", "frames", "labels")
(OCIO,) = Path(find_spec("bpy").origin).parent.glob("*/datafiles/colormanagement/config.ocio")


def bench(name, *arguments):
    """Where OCIO is set, as by a Blender that was imported, Blender prints more than it usually does."""
    command = [sys.executable, REPOSITORY / "tools" / "bench.py", name, "--quick", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "OCIO": str(OCIO)})
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The figures of quick runs, by name, all kept in one file; each is run when it is first asked for, so that two
    test processes share them."""
    file = tmp_path_factory.mktemp("bench") / "bench.json"

    class Figures(dict[str, Any]):
        def __missing__(self, name):
            assert bench(name, "--json", file).count("|") > 10
            self.update(json.loads(file.read_text()))
            return self[name]

    return Figures()


@pytest.mark.campaign
@pytest.mark.parametrize("name", MEASURED)
def test_each_says_on_what_machine_it_was_run(name, found) -> None:
    machine = found[name]["machine"]
    assert machine["cores"] == (1 if name == "labels" else len(usable_cpus()))
    assert set(machine) == {"architecture", "cores", "memory_gib", "system", "versions"}


@pytest.mark.campaign
def test_makers_of_the_same_pictures_are_held_against_the_cropped_script(found) -> None:
    """Picture by picture, every ratio is that of its processor seconds to the script's."""
    figures, makers = found["frames"], found["frames"]["makers"]
    script = figures["cpu_s"]["plain bpy script, cropped to the target's box"]
    assert len(script) == figures["pictures"] == 2
    assert sum(name.startswith("spin_usd") for name in makers) == 4
    for name, maker in makers.items():
        seconds = figures["cpu_s"][name]
        ratios = [each / other for each, other in zip(seconds, script, strict=True)]
        assert maker["cpu_s"]["least"] == min(seconds) > 0
        assert maker["cpu_over_script"]["least"] == pytest.approx(min(ratios), rel=1e-3)
        assert maker["cpu_over_script"]["most"] == pytest.approx(max(ratios), rel=1e-3)
        assert maker["total_cpu_over_script"] == pytest.approx(sum(seconds) / sum(script), abs=2e-3)


@pytest.mark.campaign
def test_every_label_has_its_cost(found) -> None:
    """Of one picture each, they are less than all together."""
    figures = found["labels"]
    assert set(PIXEL_LABELS) < set(figures["seconds"])
    assert sum(each["least"] for each in figures["seconds"].values()) <= figures["in_all"]["least"] + 1e-3


class TestEqualError:
    """The formulas of tools/bench equal_error, which takes too long to try here."""

    @pytest.fixture
    def formulas(self, monkeypatch):
        monkeypatch.syspath_prepend(REPOSITORY / "tools")
        return importlib.import_module("benchmarks.equal_error")

    def test_seconds_of_a_path_tracer_are_found_at_any_error(self, formulas) -> None:
        """A path tracer takes a + b times its samples, and the square of its error is as one over them."""
        rows = [{"cpu_s": 0.2 + 0.05 * samples, "error": 0.3 / samples**0.5} for samples in (1, 4, 16, 64)]
        for samples in (2, 30, 1000):
            assert formulas.cost_of_error(rows)(0.3 / samples**0.5) == pytest.approx(0.2 + 0.05 * samples)

    def test_noise_of_a_known_size_is_the_error(self, formulas) -> None:
        """Also where the reference has a quarter of it, and pixels beside the target have more."""
        chance, shape = np.random.default_rng(0), (100, 100, 4)
        truth = np.full(shape, 5.0)
        truth[50:, :, 3] = 0.0  # beside the target

        def light(noise):
            return truth + np.where(truth[..., 3:] > 0, noise, 1.0) * chance.normal(size=shape) * [1, 1, 1, 0]

        error, off = formulas.error_of(light(0.4), [light(0.1), light(0.1)])
        weight = 5.0 * (1 + FLOOR**2) ** 0.5
        assert error == pytest.approx(0.4 / weight, rel=0.03)
        assert off == pytest.approx(0.1 / 2**0.5 / weight, rel=0.03)

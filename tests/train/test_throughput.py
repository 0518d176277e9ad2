"""How fast pictures come to a training step: from all sources the same pictures, and a figure of each."""

import json
import os
import subprocess

import pytest

from tests.conftest import REPOSITORY
from tests.train.conftest import PYTHON

pytestmark = pytest.mark.slow

SAME_BATCH = """
import sys, numpy
from pathlib import Path
from train.fit import Training
from train.pictures import read_set
from train.throughput import exported, from_shards, in_batches
own = read_set(Path(sys.argv[1]))
training = Training(steps=1, batch=len(own.pictures), size=64, jitter=False)
folder = exported(Path(sys.argv[1]), "webdataset", Path(sys.argv[2]), "pictures=8")
((crops, heatmaps),) = in_batches(own, training, 0)
shards = iter(from_shards(sorted(map(str, folder.glob("*.tar"))), own.points, training, 0))
for theirs, ours in zip(next(shards), (crops, heatmaps)):
    numpy.testing.assert_allclose(theirs, ours, atol=1e-6)
"""


def in_train_environment(*arguments):
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY / "tools")}
    return subprocess.run([PYTHON, *map(str, arguments)], env=environment, check=True, capture_output=True, text=True)


@pytest.fixture(autouse=True)
def _environment(baseline) -> None:
    """Skip the test where the environment is not."""


def test_shards_give_the_pictures_of_the_dataset(tango, tmp_path) -> None:
    in_train_environment("-c", SAME_BATCH, tango, tmp_path / "shards")


def test_each_source_is_measured_with_each_number_of_processes(tango, tmp_path) -> None:
    figures = tmp_path / "figures.json"
    sizes = ("--steps", 4, "--batch", 4, "--size", 64, "--width", 8, "--decoder", 16)
    in_train_environment("-m", "train.throughput", tango, *sizes, "--json", figures)
    (found,) = json.loads(figures.read_text())["sets"]
    sources = {name: rate for name, rate in found["rates"].items() if name != "in memory"}
    assert set(sources) == {"dataset", "SPEED+ folder", "webdataset shards"}
    assert all(rate > 0 for of in sources.values() for way in ("read", "trained") for rate in of[way])
    assert all(len(of[way]) == 3 for of in sources.values() for way in ("read", "trained"))

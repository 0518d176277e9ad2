"""Parts by class: what is learned is found again, and scores are those of counted pixels."""

import json
import os
import shutil
import subprocess

import numpy as np
import pytest

from tests.conftest import REPOSITORY
from tests.train.conftest import PYTHON, TINY

pytestmark = pytest.mark.slow

SCORES = """
import numpy
from train.segmentation import CLASSES, scores, unions
counts = numpy.zeros((2, len(CLASSES), len(CLASSES)), int)
counts[0, 1, 1], counts[0, 1, 2], counts[0, 2, 2], counts[1, 1, 1] = 30, 10, 60, 7
numpy.testing.assert_allclose(unions(counts.sum(0))[1:4], [37 / 47, 60 / 70, numpy.nan])
found = scores(counts, ["one", "other"])
assert found["craft"] == 2 and found["iou"]["dish_antenna"] is None
assert abs(found["iou"]["main_body"] - (0.3 + 1) / (0.4 + 1)) < 1e-12  # each craft weighs the same
low, high = found["interval_95"]["main_body"]
assert abs(low - 0.75) < 1e-12 and abs(high - 1) < 1e-12  # either of the two twice
"""


@pytest.mark.usefixtures("baseline")
def test_what_is_learned_is_found_and_kept_with_its_tests(tango, tmp_path, spin_usd) -> None:
    folder = tmp_path / "craft" / "tango"
    spin_usd("render", tango.parent / "stage", "--out", folder / "dataset", "--renderer", "raycast")
    shutil.copytree(folder, tmp_path / "craft" / "again")
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY / "tools")}
    # Steps and rate at which five seeds end within 0.01 of each other: processors round differently.
    how = ("--steps", "300", "--rate", "0.003", *TINY)
    command = [PYTHON, "-m", "train.segmentation", folder / "dataset", "--out", tmp_path, *how]
    tests = ("--test", f"own={folder / 'dataset'}", "--test", f"several={tmp_path / 'craft'}")
    subprocess.run([*map(str, command), *tests], env=environment, check=True, capture_output=True)
    own, several = (json.loads((tmp_path / f"{name}.json").read_text()) for name in ("own", "several"))
    assert own["iou"]["main_body"] > 0.5
    assert own["iou"]["solar_panel"] > 0.5
    assert own["iou"]["dish_antenna"] is None  # Tango has none
    assert (own["pictures"], own["craft"]) == (16, 16)
    assert (several["pictures"], several["craft"]) == (32, 2)
    assert several["iou"] == pytest.approx(own["iou"], nan_ok=True)
    losses = json.loads((tmp_path / "training.json").read_text())["losses"]
    assert np.mean(losses[-5:]) < 0.5 * np.mean(losses[:5])


@pytest.mark.usefixtures("baseline")
def test_scores_are_those_of_counted_pixels() -> None:
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY / "tools")}
    subprocess.run([PYTHON, "-c", SCORES], env=environment, check=True)

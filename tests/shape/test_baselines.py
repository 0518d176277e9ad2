"""tools/shape in its environment: controls by the exact depth come out near zero, and SSIM is scikit-image's."""

import json
import os
import subprocess

import numpy as np
import pytest

import spin_usd as package
from spin_usd.scoring.shape_errors import similarity
from tests.conftest import REPOSITORY

PYTHON = REPOSITORY / ".venv-shape" / "bin" / "python"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.is_file(), reason="no .venv-shape; tools/shape_environment makes it"),
]
SSIM = """
import sys
import numpy as np
from skimage.metrics import structural_similarity
one, other = np.load(sys.argv[1])
options = dict(gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1.0, channel_axis=-1)
np.save(sys.argv[2], structural_similarity(one, other, full=True, **options)[1])
"""


def run(*arguments) -> None:
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY / "tools")}
    subprocess.run([PYTHON, *map(str, arguments)], env=environment, check=True, capture_output=True, text=True)


def test_exact_depth_comes_out_near_the_truth(rendered, tmp_path) -> None:
    package.export(rendered, to="unknown_target", out=tmp_path / "task")
    run("-m", "shape.baselines", tmp_path / "task", "--dataset", rendered, "--out", tmp_path / "shapes",
        "--figures", tmp_path / "rows", "--only", "points,fusion,hull")  # fmt: skip
    rows = {path.stem: json.loads(path.read_text()) for path in (tmp_path / "rows").iterdir()}
    scores = {name: row["score"] for name, row in rows.items()}
    assert set(scores) == {"task-points", "task-fusion", "task-hull"}
    assert scores["task-points"]["accuracy_m"] < 1e-5  # depth is float32
    assert scores["task-points"]["precision"] == 1
    assert scores["task-hull"]["chamfer_percent"] > scores["task-points"]["accuracy_m"]


def test_the_map_is_scikit_images(tmp_path) -> None:
    rng = np.random.default_rng(0)
    pictures = np.clip(rng.random((1, 40, 50, 3)) + rng.normal(scale=0.1, size=(2, 40, 50, 3)), 0, 1)
    np.save(tmp_path / "in.npy", pictures)
    run("-c", SSIM, tmp_path / "in.npy", tmp_path / "out.npy")
    inner = slice(5, -5)  # at the rim a window is filled up in one way or another
    found = similarity(*pictures)[inner, inner]
    np.testing.assert_allclose(found, np.load(tmp_path / "out.npy")[inner, inner], atol=1e-9)

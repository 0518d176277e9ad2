"""What docs/train_loader.py shows works as it stands."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY

DOCS = REPOSITORY / "docs"
REPROJECTION_TOLERANCE = 1e-3  # pixels: float32 body points are exact to less
pytestmark = pytest.mark.slow


def run(*arguments: object, cwd: Path) -> str:
    done = subprocess.run([sys.executable, *map(str, arguments)], capture_output=True, text=True, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_loader_s_labels_reproject_to_their_pixels(tmp_path: Path) -> None:
    *_, batch, last = run(DOCS / "train_loader.py", tmp_path / "made", cwd=tmp_path).splitlines()
    assert batch == "batch: images (2, 1200, 1920) uint8, poses (2, 4, 4) float64"
    found = re.fullmatch(r"dense pose: (\S+) pixels off at most, of 2 pictures", last)
    assert found
    assert float(found[1]) < REPROJECTION_TOLERANCE

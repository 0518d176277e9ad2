"""Labels and keys have the same bytes whatever instructions the processor has, by the libraries' own switches."""

import json
import os
import subprocess
import sys

import pytest

from tests.cases.processors import LESSER
from tests.conftest import REPOSITORY

SCRIPT = REPOSITORY / "tests" / "renderers" / "embree" / "kernels.py"


def labels(stage, isa, **variables):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", SCRIPT, isa, stage],
        capture_output=True,
        text=True,
        env={**os.environ, **variables, "PYTHONPATH": str(REPOSITORY)},
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_labels_do_not_depend_on_the_processor(small_stage) -> None:
    new, old = labels(small_stage, "avx2"), labels(small_stage, "sse2", **LESSER)
    if not new["avx"]:
        pytest.skip("this processor has no AVX")
    assert not old["avx"]
    assert not old["numpy_avx2"]
    assert min(picture["pixels"] for picture in new["labels"].values()) > 500
    assert new["labels"] == old["labels"]

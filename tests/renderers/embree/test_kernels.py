"""Labels and keys have the same bytes whatever instructions the processor has, by the libraries' own switches."""

import json
import os
import subprocess
import sys

import pytest

from tests.conftest import REPOSITORY

SCRIPT = REPOSITORY / "tests" / "renderers" / "embree" / "kernels.py"
OLD = {  # the least that numpy and OpenBLAS do with, where Embree is told isa=sse2
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Prescott",
}


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
    new, old = labels(small_stage, "avx2"), labels(small_stage, "sse2", **OLD)
    if not new["avx"]:
        pytest.skip("this processor has no AVX")
    assert not old["avx"]
    assert min(picture["pixels"] for picture in new["labels"].values()) > 500
    assert new["labels"] == old["labels"]

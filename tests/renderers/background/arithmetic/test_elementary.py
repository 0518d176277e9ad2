"""Functions of our own against numpy's in double precision, and their bytes on lesser processors."""

import os
import subprocess
import sys

import numpy as np

from spin_usd.renderers.background.arithmetic.elementary import arctan, arctan2, cosines, exp, log

NUMBERS = np.random.default_rng(0).normal(size=(2, 20_000)).astype(np.float32)
DIGEST = """
import hashlib
from tests.cases import earths
from spin_usd.renderers.background.sky import sky
from spin_usd.renderers.background.surroundings import Surroundings
for scene in (earths.low(), earths.whole()):
    arrays = sky(scene, seed=0), Surroundings.of(scene).pixels
    print(*(hashlib.sha256(array.tobytes()).hexdigest() for array in arrays))
"""
PLAIN = {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR", "OPENBLAS_CORETYPE": "Prescott"}
"""The switches by which numpy and its BLAS do without the instructions that not every processor has."""


def test_they_are_what_they_are_called() -> None:
    x, y = NUMBERS.astype(np.float64)
    np.testing.assert_allclose(exp(NUMBERS[0]), np.exp(x), rtol=1e-6)
    np.testing.assert_allclose(log(np.abs(NUMBERS[0])), np.log(np.abs(x)), atol=4e-7, rtol=4e-7)
    np.testing.assert_allclose(arctan2(NUMBERS[1], NUMBERS[0]), np.arctan2(y, x), atol=5e-7)
    inside = np.linspace(-1, 1, 1000)
    np.testing.assert_allclose(arctan(inside), np.arctan(inside), atol=1e-7)
    np.testing.assert_allclose(cosines(), np.cos(np.arange(256) / 256 * 2 * np.pi), atol=1e-13)


def test_no_light_is_made_where_there_is_no_air() -> None:
    """e to the power of 0 is 1, and of less never more."""
    nothing = np.array([0.0, -1e-30, -1e-9, -1e-7, -1e-3], np.float32)
    assert exp(nothing)[0] == 1
    assert (exp(nothing) <= 1).all()


def test_an_earth_has_the_same_bytes_on_lesser_processors() -> None:
    lesser, own = (
        subprocess.run([sys.executable, "-c", DIGEST], env={**os.environ, **more}, capture_output=True, text=True)
        for more in (PLAIN, {})
    )
    assert own.returncode == 0, own.stderr
    assert own.stdout == lesser.stdout, lesser.stderr

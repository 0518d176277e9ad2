"""Functions of our own are as near to numpy's in double precision as they say, and an Earth of them has the same bytes
on lesser processors."""

import os
import subprocess
import sys

import numpy as np
import pytest

from spin_usd.renderers.background.elementary import arctan, arctan2, cosines, exp, log
from tests.cases.processors import LESSER

TABLE = 1e-13  # the roundings of 256 products in a row, each of the one before
NUMBERS = np.random.default_rng(0).normal(size=(2, 20_000)).astype(np.float32)
DIGEST = """
import hashlib
from tests.cases import earths
from tests.cases.processors import numpy_uses_avx2
from spin_usd.renderers.background.sky import sky
from spin_usd.renderers.background.surroundings import Surroundings
print(numpy_uses_avx2())
for scene in (earths.low(), earths.whole()):
    arrays = sky(scene, seed=0), Surroundings.of(scene).pixels
    print(*(hashlib.sha256(array.tobytes()).hexdigest() for array in arrays))
"""


def test_each_is_as_near_to_numpys_as_it_says() -> None:
    x, y = NUMBERS.astype(np.float64)
    np.testing.assert_allclose(exp(NUMBERS[0]), np.exp(x), rtol=3e-7)
    np.testing.assert_allclose(log(np.abs(NUMBERS[0])), np.log(np.abs(x)), atol=2e-7, rtol=2e-7)
    np.testing.assert_allclose(arctan2(NUMBERS[1], NUMBERS[0]), np.arctan2(y, x), rtol=0, atol=4e-7)
    inside = np.linspace(-1, 1, 1000)
    np.testing.assert_allclose(arctan(inside), np.arctan(inside), rtol=0, atol=1e-7)
    np.testing.assert_allclose(cosines(), np.cos(np.arange(256) / 256 * 2 * np.pi), rtol=0, atol=TABLE)


def test_no_light_is_made_where_there_is_no_air() -> None:
    """e to the power of 0 is 1, and of less never more."""
    nothing = np.array([0.0, -1e-30, -1e-9, -1e-7, -1e-3], np.float32)
    assert exp(nothing)[0] == 1
    assert (exp(nothing) <= 1).all()


def test_an_earth_has_the_same_bytes_on_lesser_processors() -> None:
    own, lesser = (digests(**more) for more in ({}, LESSER))
    if own[0] == "False":
        pytest.skip("this processor has no AVX2")
    assert lesser[0] == "False"
    assert own[1:] == lesser[1:]
    assert len(own) == 3


def digests(**variables):
    """Whether numpy uses AVX2, and what it makes of each scene."""
    done = subprocess.run(
        [sys.executable, "-c", DIGEST], env={**os.environ, **variables}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()

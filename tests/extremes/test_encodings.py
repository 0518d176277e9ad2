"""Depth in every number a file could keep: off by half a step at most, and by no less than that somewhere."""

import numpy as np
import pytest

from tests.extremes.encodings import ENCODINGS, RANGES, depths, errors

TIGHT = 4.0  # a bound further from the worst of 20,000 would say little: a power of two may lie just below


@pytest.mark.parametrize("away", RANGES)
@pytest.mark.parametrize("encoding", ENCODINGS, ids=lambda encoding: encoding.name)
def test_each_loses_half_a_step(encoding, away) -> None:
    off, bound = errors(encoding, away)
    assert (off <= bound).all()
    if np.isinf(bound):
        assert off.max() > 1
    elif bound < np.ptp(depths(away)) / 2:  # else all depths may lie beside the same step
        assert off.max() >= bound / TIGHT

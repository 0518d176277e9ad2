"""The curve of sRGB against the standard's own formulas and figures."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.scene.derived import srgb

JUMP = 1e-7  # the standard rounds its knees: its two branches miss one another by 3e-8 there


@pytest.mark.parametrize(("encoded", "linear"), [(0, 0), (0.5, 0.21404114), (0.02, 0.02 / 12.92), (1, 1)])
def test_known_values(encoded, linear) -> None:
    assert float(srgb.decode(np.array(encoded))) == pytest.approx(linear, abs=1e-8)
    assert float(srgb.encode(np.array(linear))) == pytest.approx(encoded, abs=1e-7)


@given(st.floats(0, 1))
def test_either_direction_undoes_the_other(value) -> None:
    assert float(srgb.encode(srgb.decode(np.array(value)))) == pytest.approx(value, abs=JUMP)
    assert float(srgb.decode(srgb.encode(np.array(value)))) == pytest.approx(value, abs=JUMP)


@pytest.mark.parametrize("curve", [srgb.encode, srgb.decode])
def test_floats_keep_their_precision_and_shape(curve) -> None:
    single, double = np.zeros((2, 3, 3), np.float32), np.zeros(4)
    assert (curve(single).dtype, curve(single).shape) == (np.float32, (2, 3, 3))
    assert curve(double).dtype == np.float64

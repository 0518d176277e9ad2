"""Numbers as people read them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.accuracy.tables import number, percent, within


@given(st.floats(min_value=1e-4, max_value=1e9))
def test_a_number_has_three_digits_at_least_and_no_power_of_ten(value) -> None:
    for sign in (1, -1):
        said = number(sign * value)
        assert "e" not in said
        assert float(said) == pytest.approx(sign * value, rel=5.1e-3)


@given(st.floats(min_value=1e-6, max_value=1e7))
def test_percent_is_a_hundred_times_it(value) -> None:
    said, unit = percent(value).split(" ")
    assert unit == "%"
    assert "e" not in said
    assert float(said) == pytest.approx(100 * value, rel=5.1e-3)


@pytest.mark.parametrize(
    ("value", "said"),
    [(0, "0"), (0.0123456, "0.0123"), (999.4, "999"), (999.7, "1000"), (12345.6, "12346"), (float("inf"), "inf")],
)
def test_numbers(value, said) -> None:
    assert number(value) == said
    assert percent(value / 100) == f"{said} %"


@pytest.mark.parametrize(
    ("value", "uncertainty", "said"), [(12.0, 3.0, "12 ± 3"), (0.5, 0.0123, "0.5 ± 0.012"), (0.0, 1234.5, "0 ± 1234")]
)
def test_a_number_stands_with_its_uncertainty(value, uncertainty, said) -> None:
    assert within(value, uncertainty) == said

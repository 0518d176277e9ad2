from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.errors import InputError
from spin_usd.scene.effort import DENOISERS, MAX_BOUNCES, MAX_SAMPLES, REDUCTIONS, Effort, parse_effort

efforts = st.builds(
    Effort,
    samples=st.integers(1, MAX_SAMPLES),
    adaptive=st.floats(0, 1, exclude_max=True),
    denoiser=st.sampled_from(DENOISERS),
    bounces=st.integers(0, MAX_BOUNCES),
    clamp=st.floats(0, allow_infinity=False),
    filter_glossy=st.floats(0, 10),
    light_tree=st.booleans(),
    reduction=st.sampled_from(REDUCTIONS),
)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"samples": 1.5}, "samples is 1.5; make it a whole number"),
        ({"samples": "4"}, "samples is '4'; make it a whole number"),
        ({"samples": True}, "samples is True; make it a whole number"),
        ({"adaptive": "0.1"}, "adaptive is '0.1'; make it a number"),
        ({"denoiser": None}, "denoiser is None; make it text"),
        ({"bounces": 2.0}, "bounces is 2.0; make it a whole number"),
        ({"clamp": False}, "clamp is False; make it a number"),
        ({"filter_glossy": -0.1}, "filter_glossy is -0.1; make it 0 to 10"),
        ({"light_tree": 1}, "light_tree is 1; make it True or False"),
        ({"reduction": 2.0}, "reduction is 2.0; make it a whole number"),
    ],
)
def test_a_setting_of_another_type_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        Effort(**given)


@given(efforts)
def test_an_effort_is_read_as_it_was_written(effort) -> None:
    assert parse_effort(effort.text) == effort


def test_only_what_is_unusual_is_said() -> None:
    assert Effort().text == "samples=16"
    assert Effort(samples=4, denoiser="fast", light_tree=False).text == "samples=4,denoiser=fast,light_tree=off"


def test_numbers_are_written_with_all_their_digits_and_no_more() -> None:
    assert Effort(adaptive=0.01234567, clamp=2.0).text == "samples=16,adaptive=0.01234567,clamp=2"


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("samples=0", "samples is 0"),
        ("samples=1.5", "samples is '1.5'"),
        ("adaptive=1", "adaptive is 1"),
        ("adaptive=nan", "adaptive is nan"),
        ("denoiser=optix", "denoiser is 'optix'"),
        ("bounces=-1", "bounces is -1"),
        ("clamp=inf", "clamp is inf"),
        ("light_tree=yes", "light_tree is 'yes'"),
        ("reduction=3", "reduction is 3"),
        ("samples", "effort setting samples has no value"),
        ("sampels=4", "'sampels=4' is not an effort setting"),
        ("samples=4,samples=5", "'samples=5' is not an effort setting"),
        ("", "'' is not an effort setting"),
    ],
)
def test_what_is_no_effort_is_refused(text, names) -> None:
    with pytest.raises(InputError, match=names):
        parse_effort(text)

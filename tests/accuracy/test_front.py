"""The Pareto front and the choice on it, by their laws."""

import math
import re
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.accuracy.choice import AUTO, choose
from spin_usd.accuracy.front import Criterion, front, outcomes
from spin_usd.accuracy.measurement import Figures
from spin_usd.errors import InputError
from tests.cases.measurements import NOISE_DN, figures, frame, measurement, setting, usual

FRAMES = ("a", "b")
SETTINGS = [setting(f"samples={n}", renderer) for n in range(1, 7) for renderer in ("blender", "raycast")]
few = st.integers(1, 8).map(lambda n: n / 4)  # ties are common
errors = st.floats(1e-6, 1.0)
criteria = st.sampled_from(Criterion)


@st.composite
def measurements(draw):
    """Of two pictures, with all settings, or some, measured on both."""
    made: list[Figures] = []
    for each in draw(st.lists(st.sampled_from(SETTINGS), min_size=1, unique=True)):
        for name in FRAMES if not made else draw(st.sampled_from([FRAMES, FRAMES, FRAMES[:1]])):
            cpu_s, error, error_dn = draw(st.tuples(few, few | errors, few))
            doubt = {"uncertainty": draw(few) / 9, "error_dn_uncertainty": draw(few)}
            made.append(figures(each, cpu_s=cpu_s, error=error, error_dn=error_dn, frame=name, **doubt))
    return measurement(draw(st.permutations(made)), [frame(name, draw(few)) for name in FRAMES])


def may_be(figures):
    """The most that a relative error may be: its square is the variance, the bias squared, and one standard error."""
    return math.sqrt(figures.variance + max(figures.bias_squared, 0) + figures.uncertainty)


def cost_and_error(outcome, criterion):
    """Mean seconds, and the most that the error may be in any picture."""
    cpu_s = math.fsum(each.cpu_s for each in outcome.figures) / len(outcome.figures)
    if criterion is Criterion.LIGHT:
        return cpu_s, max(may_be(each) for each in outcome.figures)
    pairs = zip(outcome.figures, outcome.noise_dn, strict=True)
    return cpu_s, max((each.error_dn + each.error_dn_uncertainty) / noise for each, noise in pairs)


def no_worse(a, b, criterion):
    return all(x <= y for x, y in zip(cost_and_error(a, criterion), cost_and_error(b, criterion), strict=True))


@given(measurements(), criteria)
def test_the_front_is_what_no_setting_beats_and_beats_or_equals_all_others(found, criterion) -> None:
    all_of_them = outcomes(found)
    best = front(all_of_them, criterion)
    for a in best:
        assert not [b for b in all_of_them if no_worse(b, a, criterion) and not no_worse(a, b, criterion)]
    assert all(any(no_worse(a, b, criterion) for a in best) for b in all_of_them)


@given(measurements(), criteria)
def test_the_front_gets_dearer_and_more_exact(found, criterion) -> None:
    best = front(outcomes(found), criterion)
    assert best
    for cheap, dear in pairwise(cost_and_error(each, criterion) for each in best):
        assert cheap[0] < dear[0]
        assert cheap[1] > dear[1]


@given(measurements())
def test_only_settings_measured_on_all_pictures_count_and_their_worst_does(found) -> None:
    counted = {each.setting: each for each in outcomes(found)}
    for one in {each.setting for each in found.figures}:
        of_it = [each for each in found.figures if each.setting == one]
        assert (one in counted) == (len(of_it) == len(FRAMES))
        if one in counted:
            error = counted[one].error(Criterion.LIGHT)
            worst = max(of_it, key=may_be)
            assert error == pytest.approx((math.sqrt(worst.variance), may_be(worst)))
            assert counted[one].cpu_s == pytest.approx(sum(each.cpu_s for each in of_it) / len(of_it))


def chosen(found, **asked):
    try:
        return choose(found, **asked)
    except InputError:
        return None


@given(measurements(), errors, errors)
def test_a_looser_bound_never_costs_more(found, a, b) -> None:
    tight, loose = (chosen(found, error=bound) for bound in sorted((a, b)))
    assert tight is None or (loose is not None and loose.outcome.cpu_s <= tight.outcome.cpu_s)


@given(measurements(), st.none() | errors | few, st.sampled_from(["blender", "raycast"]))
def test_the_choice_is_the_cheapest_within_the_bound_on_every_picture(found, error, renderer) -> None:
    def well(outcome):
        pairs = zip(outcome.figures, outcome.noise_dn, strict=True)
        if error is None:
            return all((f.error_dn + f.error_dn_uncertainty) / noise <= AUTO for f, noise in pairs)
        return all(may_be(f) <= error for f in outcome.figures)

    candidates = [each for each in outcomes(found) if each.setting.renderer == renderer]
    enough = [each for each in candidates if well(each)]
    choice = chosen(found, error=error, auto=error is None, renderer=renderer)
    if not enough:
        assert choice is None
        return
    assert choice.outcome in enough
    cost = choice.outcome.cpu_s
    assert cost == min(each.cpu_s for each in enough)
    assert choice.cheaper is None or (choice.cheaper.cpu_s < cost and not well(choice.cheaper))
    assert (choice.cheaper is None) == (cost == min(each.cpu_s for each in candidates))


@given(measurements())
def test_what_is_advised_where_none_is_good_enough_is_good_enough(found) -> None:
    renderer = outcomes(found)[0].setting.renderer
    with pytest.raises(InputError, match="no setting measured has an error of at most") as refused:
        choose(found, error=1e-9, renderer=renderer)
    advised = re.search(r"--error (\S+) or more", str(refused.value))
    assert advised is not None
    assert choose(found, error=float(advised[1]), renderer=renderer)


def test_another_look_is_chosen_only_where_it_is_asked_for() -> None:
    assert choose(usual(), error=0.9).setting.renderer == "blender"
    assert choose(usual(), error=0.9, renderer="raycast").setting == setting("samples=1", "raycast")


def test_a_setting_that_is_within_the_bound_by_chance_is_not_chosen() -> None:
    """Its error, squared 0.0081 ± 0.002, may be above 10 %."""
    lucky = figures(setting("samples=1"), cpu_s=1.0, error=0.09, uncertainty=0.002)
    sure = figures(setting("samples=2"), cpu_s=2.0, error=0.08, uncertainty=0.0001)
    choice = choose(measurement([lucky, sure]), error=0.1)
    assert choice.setting == setting("samples=2")
    assert choice.outcome.error(Criterion.LIGHT) == pytest.approx((0.08, 0.0065**0.5))
    assert "expected error 8 % ± 0.0623 %, for 2 CPU s a picture; the next cheaper" in choice.reason
    assert choice.reason.endswith("blender samples=1, has 9 % ± 1.05 % for 1 CPU s a picture")


@pytest.mark.parametrize(
    ("brightness", "said"),
    [(-0.03, "8 %, the target 3 % darker, for"), (0.02, "8 %, the target 2 % brighter, for"), (0.005, "8 %, for")],
)
def test_the_reason_says_how_the_light_is_off(brightness, said) -> None:
    odd = replace(figures(setting("samples=2"), cpu_s=2.0, error=0.08), brightness=brightness)
    assert said in choose(measurement([odd]), error=0.1).reason


def test_the_image_of_auto_is_worse_by_what_is_promised() -> None:
    choice = choose(usual(), auto=True)
    assert all((each.error_dn**2 + NOISE_DN**2) ** 0.5 <= 2**0.5 * NOISE_DN for each in choice.outcome.figures)


def test_the_reason_says_what_is_expected_and_what_the_next_cheaper_had() -> None:
    choice = choose(usual(), error=0.1)
    assert choice.reason == (
        "blender samples=8,denoiser=fast is the cheapest setting with an error of at most 10 % in each of the "
        "3 pictures measured: expected error 7.28 %, for 1.02 CPU s a picture; the next cheaper, "
        "blender samples=4,denoiser=fast, has 10.1 % for 0.686 CPU s a picture"
    )
    assert choose(usual(), error=1.0).reason.endswith("; none is cheaper")


def test_auto_says_what_it_is_held_against() -> None:
    reason = choose(usual(), auto=True).reason
    assert "an error after the detector of at most the detector's own noise" in reason
    assert " times the noise, for " in reason


@pytest.mark.parametrize(
    ("asked", "names"),
    [
        ({}, "neither or both of error and auto"),
        ({"error": 0.1, "auto": True}, "neither or both of error and auto"),
        ({"error": 0.0}, "an error of 0 is not a bound"),
        ({"error": float("nan")}, "an error of nan is not a bound"),
        ({"error": 0.01}, "no setting measured has an error of at most 1 % in every picture: the least is"),
        ({"error": 0.5, "renderer": "raycast"}, "the least is 70 %, of raycast samples=1"),
        ({"error": 0.5, "renderer": "other"}, "no setting of the renderer other was measured on all pictures"),
    ],
)
def test_what_cannot_be_chosen_is_refused(asked, names) -> None:
    with pytest.raises(InputError, match=names):
        choose(usual(), **asked)


HALF_A_STEP = [figures(setting("samples=1"), cpu_s=1.0, error_dn=0.5)]


def test_auto_that_nothing_reaches_is_refused() -> None:
    with pytest.raises(InputError, match=r"at most the detector's own noise in every picture: the least"):
        choose(measurement(HALF_A_STEP, [frame(noise_dn=0.31)]), auto=True)


def test_a_detector_without_noise_has_nothing_to_hold_an_error_against() -> None:
    with pytest.raises(
        InputError,
        match=r"^the detector has no noise but its rounding \(0\.289 DN\); author read noise, or use --error X$",
    ):
        choose(measurement(HALF_A_STEP, [frame(noise_dn=12**-0.5)]), auto=True)


def test_without_noise_only_a_perfect_setting_is_within_it() -> None:
    found = [figures(setting("samples=1"), cpu_s=1.0, error=0.1), figures(setting("samples=2"), cpu_s=2.0)]
    assert choose(measurement(found, [frame(noise_dn=0.0)]), auto=True).setting == setting("samples=2")


def test_great_numbers_are_written_out() -> None:
    """Of a picture that takes half an hour, with an error of many times the light."""
    found = [figures(setting("samples=1"), cpu_s=1800.4, error=123.4)]
    assert choose(measurement(found), error=200.0).reason.endswith("12340 %, for 1800 CPU s a picture; none is cheaper")
    assert "times the noise, for 1800 CPU s" in choose(measurement(found, [frame(noise_dn=1e5)]), auto=True).reason
    with pytest.raises(InputError, match=r"the least is 12340 %, .* for 1800 CPU s; give --error 124 or more"):
        choose(measurement(found), error=1.0)

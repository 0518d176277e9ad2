"""The time limits of pictures follow what they are expected to take."""

from dataclasses import replace

import pytest

from spin_usd.errors import InputError
from spin_usd.options import RunOptions
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import Timings, expected_work
from spin_usd.planning.time_limit import MIN_S, TIMES, TimeLimits
from spin_usd.planning.work import CommonWork, PictureWork
from spin_usd.scene.effort import Effort

KINDS = ("image", "depth")
OPTIONS = CommonWork(renderer="blender", effort=Effort(samples=1024), kinds=KINDS, frame_pixels=1920 * 1200)
PICTURE = PlannedPicture(
    variant="v", index=0, frame="f", time_code=0.0, geometry="g", radiance="r", exposure="e", targets="t",
    region=(0, 0, 1920, 1200), target_pixels=2_000_000, light_groups=1, features=(),
)  # fmt: skip
LIMITS = TimeLimits(options=OPTIONS, workers=1, cores=1)


def test_a_long_picture_has_several_times_what_it_is_expected_to_take() -> None:
    expected = sum(expected_work(PictureWork(picture=PICTURE, label_pass=True, render=True), OPTIONS).values())
    assert expected > MIN_S
    assert LIMITS.of(PICTURE, KINDS) == pytest.approx(TIMES * expected)


def test_a_short_one_has_a_minute() -> None:
    assert LIMITS.of(PICTURE, ("depth",)) == MIN_S


def test_what_a_run_takes_longer_counts_and_what_it_takes_less_does_not() -> None:
    timings = Timings()
    limits = replace(LIMITS, measured=(Timings(), timings))
    before = limits.of(PICTURE, KINDS)
    work = expected_work(PictureWork(picture=PICTURE, label_pass=True, render=True), OPTIONS)
    timings.add(work, {kind: 0.1 * seconds for kind, seconds in work.items()})
    assert limits.of(PICTURE, KINDS) == before
    timings.add(work, {kind: 4.9 * seconds for kind, seconds in work.items()})
    assert limits.of(PICTURE, KINDS) == pytest.approx(2.5 * before, rel=1e-3)  # little work is not measured


def test_workers_that_share_a_core_need_no_more_of_its_time() -> None:
    assert replace(LIMITS, workers=4).of(PICTURE, KINDS) == LIMITS.of(PICTURE, KINDS)


def test_threads_share_the_render() -> None:
    """What counts is the processor time of the busiest thread."""
    assert replace(LIMITS, cores=4).of(PICTURE, KINDS) < LIMITS.of(PICTURE, KINDS) / 3


def test_the_users_own_limit_holds_for_all() -> None:
    assert replace(LIMITS, given=5.0).of(PICTURE, KINDS) == 5.0


@pytest.mark.parametrize("seconds", [0.0, -1.0, 0.9, 1e6, float("nan"), float("inf")])
def test_a_limit_too_short_too_long_or_not_finite_is_refused(seconds) -> None:
    with pytest.raises(InputError, match=r"picture_timeout is .*; make it 1 to 604800"):
        RunOptions(picture_timeout=seconds)

"""Light between renders, against renders: the same light from a few, and a render's noise is no light."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from spin_usd.events.light_frames import MOST_WRONG, NOISES, PART, differ
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.scene.effort import Effort
from spin_usd.scene.event_sensor import EventSensor
from spin_usd.sensor.develop import light_on_detector
from spin_usd.sensor.events import EventMaker
from tests.cases.moving import author_moving
from tests.events.conftest import SETTINGS, Moving

DARK = 1e-3


@pytest.fixture(scope="module")
def both(moving):
    """The same frames from few renders, and from one of each."""
    times = moving.steps[:17]
    few, every = moving.frames(times), moving.frames(times, every_step=True)
    return list(few.frames()), list(every.frames()), few.rendered, every.rendered


@pytest.fixture(scope="module")
def other_seed(moving):
    """Frames from a render of each of another seed."""
    seed = replace(SETTINGS, seed=1)
    return list(moving.frames(moving.steps[:17], every_step=True, settings=seed).frames())


def test_few_renders_show_what_one_of_each_step_shows(both, other_seed) -> None:
    """What asks for another render in the middle of two holds at every step, beside renders of another seed."""
    few, every, renders, all_renders = both
    assert renders < all_renders / 2
    assert all_renders == 17
    for one, other, third in zip(few, every, other_seed, strict=True):
        assert one.seconds == other.seconds
        off, noise = (
            differ(each.light, other.light, dark=DARK, most=PART * EventSensor().threshold_on)[other.light > 0].mean()
            for each in (one, third)
        )
        assert off <= MOST_WRONG + NOISES * noise


def counts_of(frames):
    """Events (2, H, W) of both signs."""
    maker = EventMaker(EventSensor(), frames[0].light.shape, seed=0)
    counts = np.zeros((2, *frames[0].light.shape), int)
    for frame in frames:
        events = maker.events(frame.light, frame.seconds)
        np.add.at(counts, (events["p"].astype(int), events["y"], events["x"]), 1)
    return counts


def test_events_of_few_renders_are_those_of_many(both, other_seed) -> None:
    """They differ as light may. Both begin and end with the same light, of which each pixel's level is less than a
    threshold off."""
    few, every, other = (counts_of(frames) for frames in (*both[:2], other_seed))
    assert every.sum() > 1000
    assert np.abs(few - every).sum() <= MOST_WRONG * every.sum() + NOISES * np.abs(other - every).sum()
    np.testing.assert_array_equal(both[0][-1].light, both[1][-1].light)
    assert np.abs(np.diff(few - every, axis=0)).max() <= 1


def test_the_first_and_the_last_frame_are_rendered_and_equal_pictures(moving, both) -> None:
    """What a picture's own render shows, by another way: the means of its pixels."""
    scene = moving.at(moving.steps[0])
    picture = moving.maker.radiance(scene, SETTINGS, Stopwatch())
    light = picture.rgb @ (np.array(scene.sensor.quantum_efficiency) * np.array(scene.sensor.panchromatic))
    shown = np.zeros(scene.camera.frame.shape)
    shown[picture.region.slices] = light * scene.sensor.exposure
    first = both[0][0].light
    assert first.sum() == pytest.approx(shown.sum(), rel=0.01)
    assert np.abs(first - shown).mean() < 0.02 * shown.max()


def test_what_no_render_saw_is_rendered(tmp_path) -> None:
    """Half a turn on it shows its back, which neither the ends nor the middle do."""
    spinning = Moving(author_moving(tmp_path / "spinning", rate=360, speed=0))
    few, every = spinning.frames(spinning.pictures), spinning.frames(spinning.pictures, every_step=True)
    for one, other in zip(few.frames(), every.frames(), strict=True):
        np.testing.assert_array_equal(one.light, other.light)
    assert few.rendered == len(spinning.pictures) == 5


@pytest.mark.slow
def test_small_targets_are_as_pictures_show_them(tmp_path) -> None:
    """Their few pixels have edges everywhere, which the rays of their middles do not tell."""
    far = Moving(author_moving(tmp_path / "far", distance=6, speed=0.2))
    frames = list(far.frames(far.pictures).frames())
    for frame in frames:
        picture = far.maker.radiance(frame.scene, SETTINGS, Stopwatch())
        np.testing.assert_array_equal(frame.light, light_on_detector(frame.scene, picture, None))
    assert frames[0].light.any()


def test_labels_are_those_of_the_pixels_rays(moving) -> None:
    (first, *_) = moving.frames(moving.steps[:2], labelled=True).frames()
    target, part = first.labels
    assert set(np.unique(target)) == {0, 1}
    assert ((part > 0) == (target > 0)).all()
    assert first.light[target > 0].mean() > 100 * first.light[target == 0].mean()


def test_what_does_not_move_makes_no_events_however_noisy_its_render(still) -> None:
    assert tuple(still.steps) == still.pictures
    noisy = replace(SETTINGS, effort=Effort(samples=1))
    frames = list(still.frames(still.steps, settings=noisy).frames())
    maker = EventMaker(EventSensor(), frames[0].light.shape, seed=0)
    assert not sum(len(maker.events(frame.light, frame.seconds)) for frame in frames)


def test_noise_is_told_from_change() -> None:
    chance = np.random.default_rng(0)
    light = np.full((60, 60), 1.0, np.float32)
    noisy = [(light * chance.lognormal(0, 0.3, light.shape)).astype(np.float32) for _ in range(2)]
    assert differ(*noisy, dark=DARK, most=0.1).mean() < 0.01
    brighter = noisy[1] * np.where(np.arange(60) < 30, 1.5, 1).astype(np.float32)
    found = differ(noisy[0], brighter, dark=DARK, most=0.1)
    assert found[:, :27].mean() > 0.9
    assert found[:, 33:].mean() < 0.02


def test_events_integrate_from_one_frame_to_the_next_within_a_threshold(both) -> None:
    frames = both[0]
    maker = EventMaker(EventSensor(), frames[0].light.shape, seed=0)
    level = np.log(frames[0].light.astype(float) + DARK)
    maker.events(frames[0].light, frames[0].seconds)
    for _, frame in pairwise(frames):
        events = maker.events(frame.light, frame.seconds)
        np.add.at(level, (events["y"], events["x"]), np.where(events["p"], 0.2, -0.2))
        assert np.abs(np.log(frame.light.astype(float) + DARK) - level).max() < 0.2 * (1 + 1e-6)

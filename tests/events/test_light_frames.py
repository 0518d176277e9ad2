"""Light between renders, against renders: the same light from a few, and a render's noise is no light."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from spin_usd.events.light_frames import differ
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.scene.effort import Effort
from spin_usd.scene.event_sensor import EventSensor
from spin_usd.sensor.events import EventMaker
from tests.events.conftest import SETTINGS

DARK = 1e-3


@pytest.fixture(scope="module")
def both(moving):
    """The same frames from few renders, and from one of each."""
    times = moving.steps[:17]
    few, every = moving.frames(times), moving.frames(times, every_step=True)
    return list(few.frames()), list(every.frames()), few.rendered, every.rendered


def test_few_renders_show_what_one_of_each_step_shows(moving, both) -> None:
    """As near as renders of other seeds are to one another, about."""
    few, every, renders, all_renders = both
    assert renders < all_renders / 2
    assert all_renders == 17
    seed = replace(SETTINGS, seed=1)
    again = moving.frames(moving.steps[:17], every_step=True, settings=seed).frames()
    for one, other, third in zip(few, every, again, strict=True):
        assert one.seconds == other.seconds
        shown = other.light > 0
        off, noise = (
            np.quantile(np.abs(np.log(each.light + DARK) - np.log(other.light + DARK))[shown], 0.9)
            for each in (one, third)
        )
        assert off < 3 * noise
        assert abs(one.light.sum() / other.light.sum() - 1) < 0.005


def test_events_of_few_renders_are_those_of_many(both) -> None:
    counts = []
    for frames in both[:2]:
        maker = EventMaker(EventSensor(), frames[0].light.shape, seed=0)
        counts.append(sum(len(maker.events(frame.light, frame.seconds)) for frame in frames))
    assert counts[1] > 1000
    assert counts[0] == pytest.approx(counts[1], rel=0.05)


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


def test_labels_are_those_of_the_pixels_rays(moving) -> None:
    (first, *_) = moving.frames(moving.steps[:2], labelled=True).frames()
    target, part = first.labels
    assert set(np.unique(target)) == {0, 1}
    assert ((part > 0) == (target > 0)).all()
    assert first.light[target > 0].mean() > 100 * first.light[target == 0].mean()


def test_what_does_not_move_makes_no_events_however_noisy_its_render(moving) -> None:
    noisy = replace(SETTINGS, effort=Effort(samples=1))
    still = moving.at(0.0)
    frames = moving.frames(np.linspace(0, 1, 9).tolist(), settings=noisy)
    frames._scene = lambda place: still
    maker = EventMaker(EventSensor(), still.camera.frame.shape, seed=0)
    assert not sum(len(maker.events(frame.light, frame.seconds)) for frame in frames.frames())


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

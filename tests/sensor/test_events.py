"""Events against closed forms: times of steady changes, counts of a sinusoid, a filter's response, rates of noise."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.scene.event_sensor import PRESETS, EventSensor
from spin_usd.sensor.events import EventMaker

DARK = 1e-3


def events_of(sensor, light, times, *, shape=(1, 1), seed=0):
    """The events of pixels in this light, (N, rows, columns) or (N,), at the times (N,)."""
    maker = EventMaker(sensor, shape, seed=seed)
    light = np.broadcast_to(np.asarray(light, float).reshape(len(times), *([1, 1] if np.ndim(light) == 1 else shape)),
                            (len(times), *shape))  # fmt: skip
    made = [maker.events(frame, time) for frame, time in zip(light, times, strict=True)]
    return np.concatenate([*made, maker.rest()])


def of_log(log):
    """Light whose current has that logarithm."""
    return np.exp(log) - DARK


@pytest.mark.parametrize("steps", [1, 7, 100])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_edge_that_moves_steadily_has_an_event_for_each_threshold(steps, sign) -> None:
    """The light of a pixel through which it passes changes at a steady rate, however few steps see it."""
    sensor, times = EventSensor(threshold_on=0.2, threshold_off=0.3, dark=DARK), np.linspace(0, 1, steps + 1)
    first, last = np.exp([-2, -2 + sign * 1.55])
    found = events_of(sensor, first + (last - first) * times - DARK, times)
    step = 0.2 if sign > 0 else 0.3
    levels = first * np.exp(sign * step * np.arange(1, int(1.55 / step) + 1))
    np.testing.assert_allclose(found["t"] / 1e6, (levels - first) / (last - first), atol=1e-6)
    assert (found["p"] == (sign > 0)).all()


@pytest.mark.parametrize("amplitude", [0.05, 0.11, 0.35, 1.02])
def test_a_sinusoid_has_as_many_events_as_levels_lie_within_it(amplitude) -> None:
    times = np.linspace(0, 10, 20_001)
    found = events_of(EventSensor(dark=DARK), of_log(-1 + amplitude * np.sin(2 * np.pi * times)), times)
    levels = 2 * int(amplitude / 0.2)  # at multiples of the threshold from where it begins
    after = (found["t"] >= 1e6) & (found["t"] < 10e6)  # the first period comes from the middle
    assert (found["p"] & after).sum() == 9 * levels
    assert (~found["p"] & after).sum() == 9 * levels


def test_a_flickering_lamp_is_damped_as_a_first_order_filter_does() -> None:
    times, mean, frequencies = np.linspace(0, 2, 8_001), 0.5, np.array([5.0, 20.0, 80.0])
    sensor = EventSensor(threshold_on=1e-3, threshold_off=1e-3, dark=DARK, cutoff=40.0)
    log = np.log(mean + DARK) + 0.1 * np.sin(2 * np.pi * times[:, None, None] * frequencies)
    found = events_of(sensor, of_log(log), times, shape=(1, 3))
    late = found[(found["t"] > 1e6) & found["p"]]
    swing = np.bincount(late["x"], minlength=3) * 1e-3 / frequencies / 2  # half the rise in a period
    np.testing.assert_allclose(swing, 0.1 / np.hypot(1, frequencies / (40.0 * (mean + DARK))), atol=1e-3)


def test_leak_comes_at_its_rate() -> None:
    """Every two seconds in each pixel, which are as far as chance has it: no window has more than others."""
    shape, times = (40, 50), np.linspace(0, 40, 41)
    sensor = EventSensor(leak=0.5, threshold_spread=0.02, dark=DARK)
    found = events_of(sensor, np.full((41, *shape), 0.3), times, shape=shape)
    assert found["p"].all()
    place = found["y"].astype(int) * shape[1] + found["x"]
    order = np.lexsort((found["t"], place))
    apart = np.diff(found["t"][order])[np.diff(place[order]) == 0]
    np.testing.assert_allclose(apart, 2e6, atol=2)
    assert len(found) == 20 * 2000
    windows = np.bincount(found["t"] // 100_000)[:20]  # 0.1 s, in which a twentieth of all pixels has one
    assert np.abs(windows - 100).max() < 4 * np.sqrt(100 * 0.95)


@pytest.mark.parametrize("noise", [0.02, 0.2, 2.0])
def test_noise_comes_before_leak_as_often_as_chance_has_it(noise) -> None:
    """A leak of period T is told where none of the noise, which begins it anew, comes in T: renewals say how often."""
    shape, times, leak = (40, 50), np.linspace(0, 20, 21), 0.1
    sensor = EventSensor(leak=leak, shot_noise=noise, shot_noise_in_white=1, dark=DARK)
    found = events_of(sensor, np.full((21, *shape), 0.3), times, shape=shape)
    for half in (found[found["t"] < 10_000_000], found[found["t"] >= 10_000_000]):
        brighter = (noise / np.expm1(noise / leak) + noise / 2) * 10 * 2000
        assert abs(half["p"].sum() - brighter) < 4 * np.sqrt(brighter)


@pytest.mark.parametrize(("light", "share"), [(0.0, 1.0), (1.0, 0.25)])
def test_noise_comes_at_its_rate_in_both_signs(light, share) -> None:
    shape, times = (40, 50), np.linspace(0, 20, 41)
    found = events_of(EventSensor(shot_noise=2.0, dark=1e-9), np.full((41, *shape), light), times, shape=shape)
    expected = 2.0 * share * 20 * 2000
    assert abs(len(found) - expected) < 3 * np.sqrt(expected)
    assert abs(found["p"].sum() - expected / 2) < 3 * np.sqrt(expected / 2)
    assert (np.diff(found["t"]) >= 0).all()
    assert len(np.unique(found["y"] * 50 + found["x"])) > 1990


def test_a_pixel_rests_after_an_event() -> None:
    times = np.linspace(0, 1, 11)
    current = np.array([0.1, 2.0])
    found = events_of(EventSensor(refractory=0.01, dark=DARK), np.interp(times, [0, 1], current) - DARK, times)
    at = found["t"] / 1e6
    rises = np.log(np.interp(at[1:], [0, 1], current) / np.interp(at[:-1] + 0.01, [0, 1], current))
    assert len(rises) > 5
    np.testing.assert_allclose(rises, 0.2, atol=1e-6 * 1.9 / 0.1)


def test_thresholds_spread_from_pixel_to_pixel() -> None:
    times, shape = np.linspace(0, 1, 2), (100, 100)
    current = np.broadcast_to((0.1 + 0.05 * times)[:, None, None], (2, *shape))
    sensor = EventSensor(threshold_spread=0.02, dark=DARK)
    found = events_of(sensor, current - DARK, times, shape=shape)
    _, at = np.unique(found["y"].astype(int) * 100 + found["x"], return_index=True)
    first = np.log1p(0.5e-6 * found["t"][at])
    assert first.mean() == pytest.approx(0.2, abs=1e-3)
    assert first.std() == pytest.approx(0.02, rel=0.05)


def test_time_stamps_are_late_and_jitter_and_in_order() -> None:
    times, shape = np.linspace(0, 1, 101), (20, 20)
    log = np.broadcast_to((-3 + 2 * times)[:, None, None], (101, *shape))
    plain = events_of(EventSensor(dark=DARK), of_log(log), times, shape=shape)
    late = events_of(EventSensor(dark=DARK, latency=1e-3, jitter=1e-4), of_log(log), times, shape=shape)
    assert len(late) == len(plain)
    assert (np.diff(late["t"]) >= 0).all()
    assert (late["t"].mean() - plain["t"].mean()) == pytest.approx(1000, abs=10)


@pytest.mark.parametrize("sensor", [EventSensor(), PRESETS["v2e_clean"]])
def test_light_that_comes_and_goes_back_leaves_as_many_events_of_both_signs(sensor) -> None:
    chance = np.random.default_rng(0)
    peaks = chance.uniform(0.02, 1, (1, 500))
    light = np.stack([np.full((1, 500), 0.1), peaks, *[np.full((1, 500), 0.1)] * 3])
    found = events_of(replace(sensor, threshold_spread=0.0), light, np.arange(5) / 100, shape=(1, 500))
    brighter, darker = (np.bincount(found["x"][found["p"] == sign], minlength=500) for sign in (True, False))
    np.testing.assert_array_equal(brighter, darker)


def test_a_noise_event_resets_the_pixel_and_is_not_told_in_its_rest() -> None:
    times, shape = np.linspace(0, 20, 201), (10, 10)
    found = events_of(EventSensor(shot_noise=20.0, refractory=0.1), np.zeros((201, *shape)), times, shape=shape)
    order = np.lexsort((found["t"], found["x"], found["y"]))
    same = np.diff(found["y"][order].astype(int) * 10 + found["x"][order]) == 0
    assert np.diff(found["t"][order])[same].min() >= 0.1e6 - 1
    expected = 20 * 100 * 20 / (1 + 20 * 0.1)  # of which those in the rest are not told
    assert abs(len(found) - expected) < 4 * np.sqrt(expected)


def test_noise_beside_changes_of_light_ends_and_adds_less_than_its_rate() -> None:
    """What a pixel was owed before a noise event is lost."""
    times, shape = np.linspace(0, 10, 101), (20, 20)
    light = 0.3 + 0.2 * np.sin(times)[:, None, None] * np.ones(shape)
    plain, noisy = (
        events_of(EventSensor(shot_noise=rate, shot_noise_in_white=1), light, times, shape=shape) for rate in (0, 1)
    )
    assert 0.5 * 10 * 400 < len(noisy) - len(plain) < 10 * 400


def test_a_maker_goes_on_from_the_state_of_another() -> None:
    sensor, shape = replace(PRESETS["v2e_noisy"], latency=1e-3, jitter=1e-4, refractory=1e-3), (20, 20)
    light = np.random.default_rng(0).uniform(0.1, 0.9, (40, *shape))
    labels = np.random.default_rng(1).integers(0, 3, (40, 2, *shape)).astype(np.uint16)
    whole, first, second = (EventMaker(sensor, shape, seed=3) for _ in range(3))
    expected = [whole.events(frame, i / 100, shown) for i, (frame, shown) in enumerate(zip(light, labels, strict=True))]
    found = [first.events(light[i], i / 100, labels[i]) for i in range(20)]
    second.resume(first.state)
    found += [second.events(light[i], i / 100, labels[i]) for i in range(20, 40)]
    np.testing.assert_array_equal(np.concatenate([*found, second.rest()]), np.concatenate([*expected, whole.rest()]))


def test_an_event_has_the_labels_of_what_comes_or_of_what_has_left() -> None:
    labels = np.array([[[3, 0, 0]], [[7, 0, 0]]], np.uint16), np.array([[[0, 4, 0]], [[0, 8, 0]]], np.uint16)
    maker = EventMaker(EventSensor(), (1, 3), seed=0)
    maker.events(np.array([[0.5, 0.1, 0.1]]), 0.0, labels[0])
    found = maker.events(np.array([[0.1, 0.5, 0.5]]), 0.1, labels[1])
    assert {(int(e["x"]), int(e["target"]), int(e["part"])) for e in found} == {(0, 3, 7), (1, 4, 8), (2, 0, 0)}


@pytest.mark.parametrize("light", [np.inf, np.nan])
def test_light_that_is_no_number_is_refused(light) -> None:
    maker = EventMaker(EventSensor(), (1, 1), seed=0)
    maker.events(np.array([[0.5]]), 0)
    with pytest.raises(InputError, match="is not finite"):
        maker.events(np.array([[light]]), 1)


def test_whole_numbers_of_seconds_are_times_too() -> None:
    maker = EventMaker(EventSensor(dark=DARK, refractory=50e-6), (1, 1), seed=0)
    maker.events(np.array([[0.1]]), 0)
    assert len(maker.events(np.array([[0.9]]), 1)) == int(np.log(0.901 / 0.101) / 0.2)

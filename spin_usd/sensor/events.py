"""Events of a camera whose pixels report changes of brightness, from the light at successive times.

A pixel's photocurrent is the light and the dark current. Its logarithm passes a first-order low-pass whose corner
frequency is proportional to the current, and is compared with the level of the last event: a rise by threshold_on, or a
fall by threshold_off, is an event, and the level moves by as much. For the filter the logarithm of the light changes at
a constant rate between two times, so its output is exact at both. Between them its exponential changes at a constant
rate, like the light of a pixel that an edge crosses: an event's time is the crossing. Leak lowers the level. After an
event the pixel is reset for the refractory time, and follows the light. Noise adds events at random times, which reset
the pixel to the light too.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, digest
from spin_usd.errors import InputError
from spin_usd.scene.event import EVENT, Events
from spin_usd.scene.event_sensor import EventSensor

MICROSECONDS = 1e6
LEAST = 0.1  # of a threshold: smaller draws would report every photon
NEARLY = 1e-9  # of a threshold: as near it counts as reached, or a light that goes and comes back would lose an event
STRAIGHT = 1e-9  # of a logarithm's change: smaller ones are lines
FARTHEST = 6.0  # standard deviations of jitter beyond which none lies
_Found = tuple[NDArray[np.int64], Float, NDArray[np.bool_]]
"""Pixels, times in seconds, and whether they are brighter."""


@dataclass(kw_only=True, eq=False)
class _Pixels:
    """The state of all pixels (N,), at one time."""

    log: Float
    """The logarithm of the current itself."""
    filtered: Float
    level: Float
    blind_until: Float
    target: NDArray[np.uint16]
    part: NDArray[np.uint16]
    """Ids of the target and part shown."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Step:
    """The time between two frames, and in it the filter's output above the leaking level: from `begin` (N,) it changes
    by `change` (N,), as a logarithm does whose argument grows by the factor exp(bend) at a steady rate."""

    begin: Float
    change: Float
    bend: Float
    start: float
    spent: float

    def at(self, pixels: NDArray[np.intp], times: Float) -> Float:
        """Return it for some pixels, each at its own time."""
        share, bend = (times - self.start) / self.spent, self._bend(pixels)
        done = np.where(share < 1, np.log1p(np.expm1(bend) * np.minimum(share, 1)) / bend, 1)
        return np.asarray(self.begin[pixels] + self.change[pixels] * done)

    def when(self, pixels: NDArray[np.intp], values: Float) -> Float:
        """Return the times at which some pixels have these values."""
        done, bend = (values - self.begin[pixels]) / self.change[pixels], self._bend(pixels)
        return np.asarray(self.start + self.spent * np.expm1(done * bend) / np.expm1(bend))

    def _bend(self, pixels: NDArray[np.intp]) -> Float:
        bend = self.bend[pixels]
        return np.where(np.abs(bend) < STRAIGHT, STRAIGHT, bend)


class EventMaker:
    """Makes the events of frames (rows, columns) of light in the unit range, as `sensor` has it; `seed` decides all
    that is random: thresholds, noise and jitter. Frames of the same times give the same events."""

    def __init__(self, sensor: EventSensor, shape: tuple[int, int], *, seed: int) -> None:
        self._sensor, self._shape, self._seed = sensor, shape, seed
        chance = _chance(seed, "thresholds").normal(size=(2, shape[0] * shape[1]))
        self._on, self._off = (
            np.maximum(mean + sensor.threshold_spread * spread, LEAST * mean)
            for mean, spread in zip((sensor.threshold_on, sensor.threshold_off), chance, strict=True)
        )
        self._pixels: _Pixels | None = None
        self._held = np.empty(0, EVENT)
        self._time = 0.0
        self._steps = 0

    def events(self, light: NDArray[np.floating], time: float, labels: NDArray[np.uint16] | None = None) -> Events:
        """Return the events (N,) of EVENT since the frame before, in order of time; none for the first frame, to which
        all pixels are adapted, each at a random distance from its next event by leak.

        time: seconds. labels (2, H, W): the ids of target and part that the pixels show; an event of a pixel that
        becomes empty has the ids from before. Raises InputError unless the time increases.
        """
        shown = np.zeros((2, light.size), np.uint16) if labels is None else labels.reshape(2, -1).copy()
        log = np.log(np.maximum(light.reshape(-1).astype(np.float64), 0.0) + self._sensor.dark)
        if self._pixels is None:
            self._pixels = _Pixels(
                log=log,
                filtered=log.copy(),
                level=log - self._leaked(log) * self._on,
                blind_until=np.full(log.shape, float(time)),
                target=shown[0],
                part=shown[1],
            )
            self._time = time
            return np.empty(0, EVENT)
        if not np.isfinite(log).all():
            raise InputError("the light on a pixel is not finite", do="look for a light of unbounded intensity")
        if time <= self._time:
            raise InputError(f"the time {time:g} s is not after {self._time:g} s", do="give frames in their order")
        before = self._pixels
        filtered = self._filtered(log, time)
        found = self._found(filtered, log, time)
        self._pixels.log, self._pixels.filtered = log, filtered
        target = np.where(shown[0] > 0, shown[0], before.target)
        part = np.where(shown[1] > 0, shown[1], before.part)
        self._pixels.target, self._pixels.part = shown
        events = self._stamped(found, time, target, part)
        self._time, self._steps = time, self._steps + 1
        return events

    def _leaked(self, log: Float) -> Float:
        """Return the random share of a threshold by which the levels have sunk since the last event: uniform, restarted
        by noise that comes before the leak."""
        if not self._sensor.leak:
            return np.zeros(len(log))
        noise = np.maximum(self._noise_rate(log) / self._sensor.leak, NEARLY)
        return np.asarray(-np.log1p(_chance(self._seed, "leak").random(len(log)) * np.expm1(-noise)) / noise)

    def _noise_rate(self, log: Float) -> Float:
        """Return the rate of noise of pixels of that logarithm of the current, Hz."""
        share = 1 - (1 - self._sensor.shot_noise_in_white) * np.minimum(np.exp(log), 1)
        return np.asarray(self._sensor.shot_noise * share)

    def _filtered(self, log: Float, time: float) -> Float:
        """Return the filter's output at the new time: exactly, for a logarithm that changes at a steady rate."""
        pixels, spent = self._pixels, time - self._time
        assert pixels is not None
        if not self._sensor.cutoff:
            return log
        current = np.exp((pixels.log + log) / 2)  # that in the middle holds for the step
        lag = 1 / (2 * np.pi * self._sensor.cutoff * current)
        slope = (log - pixels.log) / spent
        left = np.exp(-spent / lag)
        return np.asarray(log - slope * lag + (pixels.filtered - pixels.log + slope * lag) * left)

    def _found(self, end: Float, log: Float, time: float) -> list[_Found]:
        """Return pixels, times and signs of all events up to the new time, at which the filter's output is `end`."""
        pixels, spent, blind = self._pixels, time - self._time, self._sensor.refractory
        assert pixels is not None
        leak = self._sensor.leak * self._on  # of the level, per second
        bend = end - pixels.filtered
        step = _Step(begin=pixels.filtered, change=bend + leak * spent, bend=bend, start=self._time, spent=spent)
        found: list[_Found] = [(np.empty(0, np.int64), np.empty(0), np.empty(0, bool))]
        for where, at, brighter in self._noise(log, time) if self._sensor.shot_noise else ():
            found += self._crossings(step, where, at)
            seen = at >= pixels.blind_until[where]
            where, at = where[seen], at[seen]
            found.append((where, at, brighter[seen]))
            pixels.blind_until[where] = at + blind
            pixels.level[where] = step.at(where, at)
        reached, nearly = end + leak * spent, 1 - NEARLY
        some = (reached >= pixels.level + nearly * self._on) | (reached <= pixels.level - nearly * self._off)
        left = np.flatnonzero(some | (pixels.blind_until > self._time))
        found += self._crossings(step, left, np.full(len(left), time))
        pixels.level -= leak * spent
        return found

    def _crossings(self, step: "_Step", left: NDArray[np.intp], until: Float) -> list[_Found]:
        """Return the crossings of some pixels (N,) before their times `until` (N,)."""
        pixels = self._pixels
        found: list[_Found] = []
        assert pixels is not None
        while len(left):
            blind = pixels.blind_until[left]
            held = blind > step.start
            if self._sensor.refractory and held.any():  # it follows the light until then
                pixels.level[left[held]] = step.at(left[held], np.minimum(blind, until)[held])
            change = step.change[left]
            on, off = pixels.level[left] + self._on[left], pixels.level[left] - self._off[left]
            rises = change > 0
            least = NEARLY * np.where(rises, self._on[left], self._off[left])
            wanted = np.where(rises, on, off)
            reached = step.at(left, until)
            crossed = (change != 0) & np.where(rises, reached >= wanted - least, reached <= wanted + least)
            left, until, rises, wanted = left[crossed], until[crossed], rises[crossed], wanted[crossed]
            at = np.clip(step.when(left, wanted), np.maximum(step.start, blind[crossed]), until)
            found.append((left, at, rises))
            pixels.level[left] = wanted
            if self._sensor.refractory:
                pixels.blind_until[left] = at + self._sensor.refractory
                open_ = pixels.blind_until[left] < until
                beyond = left[~open_]
                pixels.level[beyond] = step.at(beyond, until[~open_])
                left, until = left[open_], until[open_]
        return found

    def _noise(self, log: Float, time: float) -> Iterator[_Found]:
        """Yield noise events, first the first event of each pixel, then the second ones: at the dark rate, of which
        light leaves a share."""
        sensor, chance = self._sensor, _chance(self._seed, "noise", str(self._steps))
        count = chance.poisson(sensor.shot_noise * (time - self._time) * len(log))
        where, at = chance.integers(len(log), size=count), np.sort(chance.uniform(self._time, time, count))
        kept = chance.random(count) * sensor.shot_noise < self._noise_rate(log[where])
        where, at, brighter = where[kept], at[kept], chance.random(count)[kept] < 0.5
        while len(where):
            _, first = np.unique(where, return_index=True)
            yield where[first], at[first], brighter[first]
            later = np.ones(len(where), bool)
            later[first] = False
            where, at, brighter = where[later], at[later], brighter[later]

    def _stamped(
        self, found: list[_Found], until: float, target: NDArray[np.uint16], part: NDArray[np.uint16]
    ) -> Events:
        """Return the events with their time stamps and the ids at their pixels (N,); events that may be stamped later
        are kept for the next time."""
        sensor = self._sensor
        pixels, at, brighter = (np.concatenate([each[i] for each in found]) for i in range(3))
        at = at + sensor.latency
        if sensor.jitter:
            at += sensor.jitter * _chance(self._seed, "jitter", str(self._steps)).normal(size=len(at))
        made = np.empty(len(at), EVENT)
        made["t"], made["p"] = np.rint(at * MICROSECONDS), brighter
        made["y"], made["x"] = np.divmod(pixels, self._shape[1])
        made["target"], made["part"] = target[pixels], part[pixels]
        held = np.concatenate([self._held, made])
        held = held[np.lexsort((held["x"], held["y"], held["t"]))]
        done = np.searchsorted(held["t"], (until + sensor.latency - FARTHEST * sensor.jitter) * MICROSECONDS)
        self._held = held[done:]
        return held[:done]

    @property
    def state(self) -> dict[str, NDArray[Any]]:
        """All that decides the events to come, as arrays by name, for `resume`."""
        assert self._pixels is not None
        kept = {name: array.copy() for name, array in vars(self._pixels).items()}
        return {**kept, "held": self._held, "time": np.array(self._time), "steps": np.array(self._steps)}

    def resume(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on from the `state` of another maker of the same sensor, shape and seed."""
        self._pixels = _Pixels(**{each.name: state[each.name] for each in fields(_Pixels)})
        self._held, self._time, self._steps = state["held"], float(state["time"]), int(state["steps"])

    def rest(self) -> Events:
        """Return the events that were kept back, since others might have been stamped before them."""
        rest, self._held = self._held, np.empty(0, EVENT)
        return rest


def _chance(seed: int, *names: str) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(key=int(digest([seed, *names])[:32], 16)))

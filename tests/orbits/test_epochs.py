"""Sun, Moon and the Earth's axes against JPL's DE421, read by Skyfield; frames and time scales by their definitions."""

from datetime import datetime, timedelta

import numpy as np
import pytest
from skyfield.framelib import itrs
from skyfield.sgp4lib import TEME as SKYFIELD_TEME

from spin_usd.errors import InputError
from spin_usd.orbits.epochs import EME2000, GCRF, ITRF, TEME, Epochs, frame_named

EPOCH = "2001-01-15T00:00:00Z"
DATES = np.arange(20) * 4.77e7  # seconds: a year and a half apart, to 2029
ARCSECOND = np.pi / 648000
SUN, MOON = 0.05 * ARCSECOND, 15 * ARCSECOND  # of the formulas behind astropy's built-in ephemeris
MOON_M, SUN_RELATIVE = 30e3, 1e-7
EARTH = 1.0 * ARCSECOND  # Skyfield has no polar motion, which is up to 0.5 arcseconds, and UT1 of its own


@pytest.fixture(scope="module")
def epochs() -> Epochs:
    return Epochs(EPOCH, DATES)


@pytest.fixture(scope="module")
def skyfield_times(timescale, epochs):
    return timescale.tt_jd(epochs.time.tt.jd)


def angle(a, b):
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.arctan2(cross, (a * b).sum(-1))


def test_the_sun_is_where_jpl_has_it(epochs, skyfield_times, de421) -> None:
    jpl = (de421["sun"] - de421["earth"]).at(skyfield_times).position.m.T
    assert angle(epochs.sun, jpl).max() < SUN
    assert np.linalg.norm(epochs.sun, axis=1) == pytest.approx(np.linalg.norm(jpl, axis=1), rel=SUN_RELATIVE)


def test_the_moon_is_where_jpl_has_it(epochs, skyfield_times, de421) -> None:
    jpl = (de421["moon"] - de421["earth"]).at(skyfield_times).position.m.T
    assert angle(epochs.moon, jpl).max() < MOON
    assert np.abs(np.linalg.norm(epochs.moon, axis=1) - np.linalg.norm(jpl, axis=1)).max() < MOON_M


def test_the_earth_is_turned_as_another_library_has_it(epochs, skyfield_times) -> None:
    known = np.moveaxis(itrs.rotation_at(skyfield_times), -1, 0)  # from ICRF to ITRF
    off = known @ epochs.R_gcrf_itrf
    turned = np.linalg.norm(off - np.swapaxes(off, 1, 2), axis=(1, 2)) / np.sqrt(8)
    past = DATES < 7.8e8  # Skyfield's UT1 of later years is a guess
    assert turned[past].max() < EARTH


def test_frames_are_those_of_their_definitions(epochs, skyfield_times) -> None:
    bias = epochs.axes_of(EME2000)[0]
    assert angle(bias[:, 2], np.array([0, 0, 1.0])) / ARCSECOND == pytest.approx(0.0179, abs=0.001)  # IERS TN 36
    teme = np.moveaxis(SKYFIELD_TEME.rotation_at(skyfield_times), -1, 0) @ epochs.axes_of(TEME)
    assert np.abs(teme - np.eye(3)).max() < EARTH
    for frame in (GCRF, EME2000, TEME, ITRF):
        axes = epochs.axes_of(frame)
        assert axes @ np.swapaxes(axes, 1, 2) == pytest.approx(np.broadcast_to(np.eye(3), axes.shape), abs=1e-12)


def test_what_rests_on_the_ground_moves_with_it(epochs) -> None:
    resting = np.tile([4e6, 3e6, 4e6, 0, 0, 0], (len(DATES), 1))
    states = epochs.states_from(ITRF, resting)
    pole = epochs.R_gcrf_itrf[:, :, 2]
    speed = np.linalg.norm(np.cross(7.292115e-5 * pole, states[:, :3]), axis=1)  # IERS TN 36
    assert np.linalg.norm(states[:, 3:], axis=1) == pytest.approx(speed, rel=1e-5)


@pytest.mark.parametrize(
    ("scale", "later"), [("UTC", 0.0), ("TAI", -37.0), ("TT", -69.184), ("GPS", -18.0), ("tdb", -69.184)]
)
def test_time_scales_are_apart_as_they_are(scale, later) -> None:
    epochs = Epochs("2026-03-01T00:00:00Z", np.zeros(1))
    (seconds,) = epochs.seconds_of(["2026-03-01T00:00:00"], scale, "a file")
    assert seconds == pytest.approx(later, abs=2e-3)  # TDB is off TT by 1.7 ms at most


def test_a_leap_second_is_a_second() -> None:
    start = datetime(2016, 12, 31, 23, 59, 50)
    epochs = Epochs(f"{start.isoformat()}Z", np.zeros(1))
    (seconds,) = epochs.seconds_of([(start + timedelta(seconds=20)).isoformat()], "UTC", "a file")
    assert seconds == pytest.approx(21, abs=1e-6)


@pytest.mark.parametrize("name", ["ITRF2014", "J2000", "icrf", "TEME"])
def test_frames_have_several_names(name) -> None:
    assert frame_named(name, "a file") in (GCRF, EME2000, TEME, ITRF)


def test_what_is_not_known_is_refused() -> None:
    with pytest.raises(InputError, match="unknown frame 'MOON_PA'; give it in one of ICRF"):
        frame_named("MOON_PA", "a file")
    epochs = Epochs("2026-03-01T00:00:00Z", np.zeros(1))
    with pytest.raises(InputError, match="time system 'MRT'"):
        epochs.seconds_of(["2026-03-01T00:00:00"], "MRT", "a file")
    with pytest.raises(InputError, match="contains 'noon', which is not a time"):
        epochs.seconds_of(["noon"], "UTC", "a file")
    with pytest.raises(InputError, match="choose a year from 1973"):
        Epochs("1900-01-01T00:00:00Z", np.zeros(1))

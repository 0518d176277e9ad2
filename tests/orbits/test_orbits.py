"""Orbits in files, as other programs have them."""

import re
from pathlib import Path

import numpy as np
import pytest
import spiceypy
from ccsds_ndm.ndm_io import NDMFileFormats, NdmIo
from skyfield.api import EarthSatellite

from spin_usd.errors import InputError
from spin_usd.orbits.epochs import GCRF, Epochs
from spin_usd.orbits.orbit_context import OrbitContext
from spin_usd.orbits.orbits import Keplerian, Oem, Spice, StateVector, Tle
from spin_usd.orbits.propagation import propagated, state_of

EPOCH = "2024-05-01T12:00:00Z"
POLE = Epochs(EPOCH, np.zeros(1)).R_gcrf_itrf[0, :, 2]
STEP = 60.0
START = state_of(7.078e6, 0.002, 1.71, 0.4, 0.2, 0.3)
BETWEEN_M = 1e-4  # of quintics between states a minute apart
TEME_M = 5.0  # between two libraries' axes, 0.1 arcseconds at 7,000 km
# A real one, of the International Space Station (public, space-track.org).
ISS = """ISS (ZARYA)
1 25544U 98067A   24122.50000000  .00016717  00000-0  30270-3 0  9990
2 25544  51.6400 208.9163 0006317  69.9862  25.2906 15.50103472    19
"""


def context(folder: Path, *seconds: float, epoch: str = EPOCH, **fields) -> OrbitContext:
    return OrbitContext(epochs=Epochs(epoch, np.array(seconds, float)), folder=folder, **fields)


def checksum(line: str) -> str:
    total = sum(int(each) if each.isdigit() else each == "-" for each in line[:68])
    return f"{line[:68]}{total % 10}"


def tle(folder: Path, text: str = ISS) -> Tle:
    lines = [checksum(f"{line:<69}") if line[:2] in ("1 ", "2 ") else line for line in text.splitlines()]
    (folder / "craft.tle").write_text("\n".join(lines) + "\n")
    return Tle(file="craft.tle")


def oem(folder: Path, *, frame="EME2000", system="TAI", count=12, states=None, name="craft.oem") -> Oem:
    """An OEM of an orbit about a flattened Earth, a state a minute."""
    times = STEP * np.arange(count) - 2 * STEP
    rows = propagated(START, times, POLE) if states is None else states
    epochs = Epochs(EPOCH, times)
    own = np.swapaxes(epochs.axes_of(frame), 1, 2)
    rows = np.concatenate([np.einsum("nij,nj->ni", own, rows[:, :3]), np.einsum("nij,nj->ni", own, rows[:, 3:])], -1)
    scale = epochs.time.tai if system == "TAI" else epochs.time.utc
    stamps = [each.replace(" ", "T") for each in scale.iso]
    scale.precision = 9
    stamps = [each.replace(" ", "T") for each in scale.iso]
    lines = [
        f"{stamp} {' '.join(f'{value:.12f}' for value in row / 1e3)}" for stamp, row in zip(stamps, rows, strict=True)
    ]
    head = f"""CCSDS_OEM_VERS = 2.0
CREATION_DATE = 2024-05-01T00:00:00
ORIGINATOR = TEST
META_START
OBJECT_NAME = CRAFT
OBJECT_ID = 2024-001A
CENTER_NAME = EARTH
REF_FRAME = {frame}
TIME_SYSTEM = {system}
START_TIME = {stamps[0]}
STOP_TIME = {stamps[-1]}
META_STOP
"""
    (folder / name).write_text(head + "\n".join(lines) + "\n")
    return Oem(file=name)


@pytest.mark.parametrize(("frame", "system"), [("EME2000", "TAI"), ("ICRF", "UTC")])
def test_an_oem_gives_the_orbit_that_was_written(tmp_path: Path, frame: str, system: str) -> None:
    seconds = np.arange(-100.0, 500.0, 7.3)
    found = oem(tmp_path, frame=frame if frame == "EME2000" else GCRF, system=system).states(
        context(tmp_path, *seconds)
    )
    known = propagated(START, seconds, POLE)
    assert np.abs(found - known)[:, :3].max() < BETWEEN_M
    assert np.abs(found - known)[:, 3:].max() < BETWEEN_M / 10


def test_the_first_version_and_days_of_the_year_are_read(tmp_path: Path) -> None:
    orbit, asked = oem(tmp_path), context(tmp_path, 0.0, 33.0)
    known, file = orbit.states(asked), tmp_path / "craft.oem"
    text = file.read_text().replace("CCSDS_OEM_VERS = 2.0", "CCSDS_OEM_VERS = 1.0")
    file.write_text(text.replace("2024-05-01T", "2024-122T"))
    assert np.array_equal(orbit.states(asked), known)


def test_an_oem_in_xml_is_the_same(tmp_path: Path) -> None:
    written = oem(tmp_path)
    NdmIo().to_file(NdmIo().from_path(tmp_path / "craft.oem"), NDMFileFormats.XML, tmp_path / "craft.xml")
    asked = context(tmp_path, 0.0, 33.0)
    assert np.array_equal(Oem(file="craft.xml").states(asked), written.states(asked))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("<X>", "<Q>"), "line 21: is not XML from there on: a tag is cut, or lacks its partner; mend it"),
        (("<X>", "<ORIGINATOR>US</ORIGINATOR><X>"), "line 21: has ORIGINATOR twice, or where CCSDS does not define it"),
        (("<CREATION_DATE>2024-05-01T00:00:00</CREATION_DATE>", ""), ": does not state CREATION_DATE"),
        (("</EPOCH>", "</EPOCH><EPOCH>2024-05-01T00:00:00</EPOCH>"), "line 20: has EPOCH twice"),
        (("<X>", "<X>x"), ": has the state of .*, which is not complete"),
    ],
)
def test_a_damaged_xml_is_told_in_our_words(tmp_path: Path, change, says: str) -> None:
    oem(tmp_path)
    file = tmp_path / "craft.xml"
    NdmIo().to_file(NdmIo().from_path(tmp_path / "craft.oem"), NDMFileFormats.XML, file)
    old, new = change
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=rf"craft\.xml.*{says}") as refused:
        Oem(file="craft.xml").states(context(tmp_path, 0.0))
    assert not re.search("damaged|__|[Pp]roperty|argument", refused.value.found)


def test_a_tle_is_where_another_library_has_it(tmp_path: Path, timescale) -> None:
    asked = context(tmp_path, *np.arange(0.0, 6000.0, 500.0))
    found = tle(tmp_path).states(asked)
    lines = [line for line in (tmp_path / "craft.tle").read_text().splitlines() if line[:2] in ("1 ", "2 ")]
    craft = EarthSatellite(*lines, ts=timescale)
    known = craft.at(timescale.tt_jd(asked.epochs.time.tt.jd1, asked.epochs.time.tt.jd2))
    assert np.abs(found[:, :3] - known.position.m.T).max() < TEME_M
    assert np.abs(found[:, 3:] - known.velocity.km_per_s.T * 1e3).max() < TEME_M / 900
    assert not asked.notes


def test_a_tle_of_other_weeks_is_told(tmp_path: Path) -> None:
    asked = context(tmp_path, 0.0, epoch="2024-05-22T12:00:00Z")
    tle(tmp_path).states(asked)
    assert list(asked.notes) == ["craft.tle is 21 days from its epoch; expect about 43 km of error"]


def test_spice_kernels_are_read(tmp_path: Path) -> None:
    seconds = np.arange(-600.0, 1200.0, 30.0)
    states = propagated(START, seconds, POLE)
    tdb = Epochs(EPOCH, seconds).time.tdb
    et = (tdb.jd1 - 2451545.0) * 86400 + tdb.jd2 * 86400
    handle = spiceypy.spkopn(str(tmp_path / "craft.bsp"), "made by a test", 0)
    spiceypy.spkw13(handle, -999, 399, "J2000", et[0], et[-1], "craft", 7, len(et), states / 1e3, et)
    spiceypy.spkcls(handle)
    found = Spice(kernels=("craft.bsp",), body="-999").states(context(tmp_path, 0.0, 45.5))
    assert np.abs(found - propagated(START, np.array([0.0, 45.5]), POLE))[:, :3].max() < 5e-3  # of float64 seconds
    for folder, there in (("up", ".."), (".", ".")):  # whatever the working directory is
        (tmp_path / folder).mkdir(exist_ok=True)
        paths = f"PATH_VALUES = ( '{there}' )\nPATH_SYMBOLS = ( 'K' )\nKERNELS_TO_LOAD = ( '$K/cra+', 'ft.bsp' )\n"
        (tmp_path / folder / "meta.tm").write_text(f"KPL/MK\n\\begindata\n{paths}\\begintext\n")
        of_meta = Spice(kernels=(f"{folder}/meta.tm",), body="-999").states(context(tmp_path, 0.0, 45.5))
        assert np.array_equal(of_meta, found)
    with pytest.raises(InputError, match=r"gives no orbit of -998"):
        Spice(kernels=("craft.bsp",), body="-998").states(context(tmp_path, 0.0))


def test_what_is_propagated_begins_where_it_says(tmp_path: Path) -> None:
    asked = context(tmp_path, 0.0, 100.0)
    elements = {"semi_major_axis": 7.078e6, "eccentricity": 0.002, "inclination_deg": np.degrees(1.71)}
    angles = {"node_deg": np.degrees(0.4), "perigee_deg": np.degrees(0.2), "mean_anomaly_deg": np.degrees(0.3)}
    by_elements = Keplerian(**elements, **angles).states(asked)
    by_state = StateVector(place=tuple(START[:3]), velocity=tuple(START[3:])).states(asked)
    assert by_elements == pytest.approx(by_state, rel=1e-12)
    assert by_elements[0] == pytest.approx(START, rel=1e-12)
    in_teme = StateVector(place=tuple(START[:3]), velocity=tuple(START[3:]), frame="TEME").states(asked)
    assert np.linalg.norm(in_teme[0, :3] - START[:3]) > 1e4  # precession since 2000


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("REF_FRAME = EME2000", "REF_FRAME = LVLH"), "is in the unknown frame 'LVLH'"),
        (("CENTER_NAME = EARTH", "CENTER_NAME = MARS"), "is about MARS; give an orbit about the Earth"),
        (("TIME_SYSTEM = TAI", "TIME_SYSTEM = SCLK"), "time system 'SCLK'"),
        (("META_STOP\n", "META_STOP\n2024-05-01T13:00:37 7000 0 0 0 7.5 0\n"), "goes back by .* at state 2"),
        (("CCSDS_OEM_VERS = 2.0", "CCSDS_WHAT = 2.0"), "is not a CCSDS message; convert it"),
        (("2024-05-01T12:01:37", "2024-05-01T25:01:37"), "contains '2024-05-01T25:01:37.0*', which is not a time"),
        (("REF_FRAME = EME2000\n", ""), "does not state REF_FRAME; add it"),
        (("META_STOP\n", "META_STOP\n2024-05-01T11:00:00 7000 0 0 0 -7\n"), "line 13: has 5 numbers .*, expected 6"),
        (("META_STOP\n", "META_STOP\n2024-05-01T11:00:00 7e999 0 0 0 7 0\n"), "line 13: contains '7e999', which is"),
        (("META_STOP\n", "META_STOP\n2024-05-01T11:00:00 7000 x 0 0 7 0\n"), "line 13: contains 'x', which is"),
        (("CCSDS_OEM_VERS = 2.0", "CCSDS_OEM_VERS = 9.0"), "cannot be read as a CCSDS OEM of version 9.0; check"),
        (("CCSDS_OEM_VERS", "Dear all\nCCSDS_OEM_VERS"), "begins with 'Dear all', not with CCSDS_OEM_VERS; remove"),
        (("_OEM_", "_OCM_"), "is a CCSDS OCM, not an OEM; give an OEM"),
        (("_OEM_", "_OPM_"), "is a CCSDS OPM, not an OEM; give its state as an orbit of kind state"),
        (("CCSDS_OEM_VERS", "#cP2024  5  1 12"), "is an SP3 orbit; convert it to an OEM"),
        (("CCSDS_OEM_VERS", "H1 CPF  2"), "is a CPF prediction; convert it to an OEM"),
    ],
)
def test_an_oem_that_cannot_be_used_is_told(tmp_path: Path, change, says: str) -> None:
    orbit = oem(tmp_path)
    file = tmp_path / "craft.oem"
    file.write_text(file.read_text().replace(*change))
    with pytest.raises(InputError, match=rf"craft\.oem[:,] .*{says}"):
        orbit.states(context(tmp_path, 0.0))


def test_moments_outside_a_file_are_told(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"craft\.oem: has no state at second 4000; choose times within its useable span"
    ):
        oem(tmp_path).states(context(tmp_path, 0.0, 4000.0))


def segments(folder: Path, *changes: tuple[str, str], file: str = "craft.oem") -> Oem:
    """An OEM of the orbit's segment, and of the same again with the changes."""
    text = oem(folder).file and (folder / file).read_text()
    again = text[text.index("META_START") :]
    for change in changes:
        again = again.replace(*change)
    (folder / file).write_text(text + again)
    return Oem(file=file)


SECOND = (("OBJECT_NAME = CRAFT", "OBJECT_NAME = OTHER"), ("2024-001A", "2024-001B"))


def test_one_craft_of_several_is_chosen_by_name_or_id(tmp_path: Path) -> None:
    asked, alone = context(tmp_path, 0.0, 70.0), oem(tmp_path).states(context(tmp_path, 0.0, 70.0))
    both = segments(tmp_path, *SECOND, ("EME2000", "TEME"))
    with pytest.raises(
        InputError, match=r"is of CRAFT \(2024-001A\), OTHER \(2024-001B\); name one of them, as object"
    ):
        both.states(asked)
    for name in ("CRAFT", "2024-001A"):
        assert np.array_equal(Oem(file=both.file, craft=name).states(asked), alone)
    with pytest.raises(InputError, match="is of CRAFT"):
        Oem(file=both.file, craft="2024-001").states(asked)


def test_states_are_used_within_their_useable_span(tmp_path: Path) -> None:
    stop = "STOP_TIME = 2024-05-01T12:01:37.000000000\n"  # second 60: TAI
    useable = f"USEABLE_START_TIME = 2024-05-01T12:00:37\nUSEABLE_{stop}STOP_TIME"
    orbit, file = oem(tmp_path), tmp_path / "craft.oem"
    known = orbit.states(context(tmp_path, 0.0, 60.0))
    file.write_text(file.read_text().replace("STOP_TIME", useable, 1))
    assert np.array_equal(orbit.states(context(tmp_path, 0.0, 60.0)), known)
    for second in (-30.0, 90.0):
        with pytest.raises(InputError, match=f"has no state at second {second:g}"):
            orbit.states(context(tmp_path, second))


def test_segments_that_overlap_agree_or_are_told(tmp_path: Path) -> None:
    asked = context(tmp_path, 0.0, 70.0)
    assert np.array_equal(segments(tmp_path).states(asked), oem(tmp_path).states(asked))
    assert not asked.notes
    segments(tmp_path, ("EME2000", "TEME")).states(asked)
    assert list(asked.notes) == [
        "craft.oem has segments that overlap and differ by more than 0.01 m; the later one is used"
    ]


def test_entities_are_refused(tmp_path: Path) -> None:
    (tmp_path / "bomb.xml").write_text(
        '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><oem id="CCSDS_OEM_VERS">&b;</oem>'
    )
    with pytest.raises(InputError, match="defines entities"):
        Oem(file="bomb.xml").states(context(tmp_path, 0.0))


@pytest.mark.parametrize(
    "text", ["ISS\n1 25544U\n", "", ISS.replace("2 25544", "3 25544"), ISS.replace("51.6400", "51.6x00")]
)
def test_what_is_no_tle_is_told(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=r"craft\.tle: (is not a valid|does not contain|has no orbit at)"):
        tle(tmp_path, text).states(context(tmp_path, 0.0))


def test_a_tle_with_a_wrong_checksum_is_told(tmp_path: Path) -> None:
    orbit = tle(tmp_path)
    file = tmp_path / "craft.tle"
    file.write_text(file.read_text().replace("51.6400", "52.6400"))
    with pytest.raises(InputError, match="is not a valid TLE"):
        orbit.states(context(tmp_path, 0.0))

"""Mean elements: an OMM in each of its forms gives the orbit of the same TLE, and one craft of several is chosen."""

import json

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.orbits.orbits import Tle
from tests.orbits.test_orbits import ISS, checksum, context

EPOCH_M = 0.01  # from the epoch, which an OMM has to the microsecond, and SGP4 as days since 1950
FIRST, SECOND = (checksum(f"{line:<69}") for line in ISS.splitlines()[1:])
OF_ISS = {
    "OBJECT_NAME": "ISS (ZARYA)", "OBJECT_ID": "1998-067A", "EPOCH": "2024-05-01T12:00:00.000000",
    "MEAN_MOTION": "15.50103472", "ECCENTRICITY": ".0006317", "INCLINATION": "51.64", "RA_OF_ASC_NODE": "208.9163",
    "ARG_OF_PERICENTER": "69.9862", "MEAN_ANOMALY": "25.2906", "NORAD_CAT_ID": "25544", "BSTAR": ".3027e-3",
    "MEAN_MOTION_DOT": ".00016717", "MEAN_MOTION_DDOT": "0",
}  # fmt: skip


def kvn(fields):
    return "CCSDS_OMM_VERS = 2.0\nCOMMENT none\n" + "".join(f"{key} = {value}\n" for key, value in fields.items())


def csv(*rows):
    return "".join(",".join(row) + "\n" for row in (rows[0], *(each.values() for each in rows)))


def xml(fields):
    def tagged(*names):
        return "".join(f"<{name}>{fields[name]}</{name}>" for name in names)

    names = list(fields)
    metadata, elements = tagged(*names[:2]), tagged(*names[2:9])
    data = f"<meanElements>{elements}</meanElements><tleParameters>{tagged(*names[9:])}</tleParameters>"
    return f"<ndm><omm><body><segment><metadata>{metadata}</metadata><data>{data}</data></segment></body></omm></ndm>"


def test_elements_of_another_theory_are_no_tle(tmp_path) -> None:
    (tmp_path / "craft.omm").write_text("CCSDS_OMM_VERS = 2.0\nSEMI_MAJOR_AXIS = 6800\n")
    with pytest.raises(InputError, match="has no mean motion, which SGP4 needs; give an OMM with"):
        Tle(file="craft.omm").states(context(tmp_path))


def states(folder, text, craft=None):
    (folder / "craft.txt").write_text(text)
    return Tle(file="craft.txt", craft=craft).states(context(folder, 0.0, 3000.0))


@pytest.mark.parametrize("number", ["25544", "100000", "799999999"])
@pytest.mark.parametrize("write", [kvn, csv, xml, lambda fields: json.dumps([fields]), json.dumps])
def test_an_omm_is_the_orbit_of_its_tle(tmp_path, write, number) -> None:
    found = states(tmp_path, write(OF_ISS | {"NORAD_CAT_ID": number}))
    known = states(tmp_path, f"{FIRST}\n{SECOND}\n")
    assert np.abs(found - known)[:, :3].max() < EPOCH_M


def test_units_and_days_of_the_year_are_read(tmp_path) -> None:
    fields = OF_ISS | {"INCLINATION": "51.64 [deg]", "EPOCH": "2024-122T12:00:00", "MEAN_ELEMENT_THEORY": "SGP/SGP4"}
    assert np.array_equal(states(tmp_path, kvn(fields)), states(tmp_path, kvn(OF_ISS)))


@pytest.mark.parametrize("number", ["    7", "A0007", "00007"])
def test_a_number_may_be_padded_or_have_a_letter(tmp_path, number) -> None:
    lines = [checksum(f"{line[:2]}{number}{line[7:]}") for line in (FIRST, SECOND)]
    assert np.array_equal(states(tmp_path, "\n".join(lines)), states(tmp_path, f"{FIRST}\n{SECOND}\n"))


def test_one_craft_of_several_is_chosen(tmp_path) -> None:
    other = [checksum(line.replace("25544", "A0007").replace("208.9163", "108.9163")) for line in (FIRST, SECOND)]
    several = "\n".join(["ISS", FIRST, SECOND, "0 OTHER", *other])
    with pytest.raises(InputError, match=r"contains 2 sets of elements \(ISS 25544, OTHER 100007\); name one craft"):
        states(tmp_path, several)
    for name in ("OTHER", "100007"):
        assert np.array_equal(states(tmp_path, several, name), states(tmp_path, "\n".join(other)))
    both = csv(OF_ISS, OF_ISS | {"OBJECT_NAME": "OTHER", "NORAD_CAT_ID": "100007", "MEAN_ANOMALY": "9"})
    assert np.array_equal(states(tmp_path, both, "25544"), states(tmp_path, csv(OF_ISS)))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (kvn(OF_ISS | {"REF_FRAME": "EME2000"}), "has REF_FRAME 'EME2000', not TEME"),
        (kvn(OF_ISS | {"MEAN_ELEMENT_THEORY": "DSST"}), "has MEAN_ELEMENT_THEORY 'DSST', not SGP4"),
        (csv({key: value for key, value in OF_ISS.items() if key != "BSTAR"}), "has no BSTAR"),
        (kvn(OF_ISS | {"INCLINATION": "steep"}), "has the INCLINATION 'steep'"),
        (kvn(OF_ISS | {"EPOCH": "noon"}), "has the EPOCH 'noon'"),
        (kvn(OF_ISS | {"MEAN_MOTION": "200"}), "has no orbit at these epochs"),
        ("<!DOCTYPE a>" + xml(OF_ISS), "defines entities"),
        (f"{FIRST}\n{FIRST}\n{SECOND}\n", "does not contain one TLE"),
        (f"{FIRST}\n{SECOND}\n{FIRST}\n{SECOND}\n", r"contains 2 sets of elements \(25544\)"),
    ],
)
def test_other_elements_are_refused(tmp_path, text, found) -> None:
    with pytest.raises(InputError, match=rf"craft\.txt(, line \d+)?: {found}"):
        states(tmp_path, text)


@pytest.mark.parametrize("write", [kvn, xml, csv, json.dumps])
@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("MEAN_MOTION", "zz", "has the MEAN_MOTION 'zz', expected a number; mend"),
        ("EPHEMERIS_TYPE", "0.5", "has the EPHEMERIS_TYPE '0.5', expected a whole number; mend"),
        ("EPOCH", "yesterday", "has the EPOCH 'yesterday', expected UTC such as"),
    ],
)
def test_a_field_that_is_wrong_is_named(tmp_path, write, key, value, says) -> None:
    with pytest.raises(InputError, match=says) as refused:
        states(tmp_path, write({"EPHEMERIS_TYPE": "0"} | OF_ISS | {key: value}))
    assert "damaged" not in str(refused.value)


def test_the_line_of_a_field_is_told(tmp_path) -> None:
    with pytest.raises(InputError, match=r"craft\.txt, line 6: has the MEAN_MOTION 'zz'"):
        states(tmp_path, kvn(OF_ISS | {"MEAN_MOTION": "zz"}))
    with pytest.raises(InputError, match=r"craft\.txt, line 1: is not XML from there on: a tag is cut"):
        states(tmp_path, xml(OF_ISS)[:-5])


def test_whole_numbers_that_a_json_writer_gives_as_floats_are_read(tmp_path) -> None:
    floats = OF_ISS | {"EPHEMERIS_TYPE": 0.0, "ELEMENT_SET_NO": 999.0, "NORAD_CAT_ID": 25544.0}
    known = states(tmp_path, json.dumps(OF_ISS))
    assert np.array_equal(states(tmp_path, json.dumps(floats), craft="25544"), known)

"""Attitudes: what points does, what is read means what its standard says, what tumbles keeps its momentum."""

from pathlib import Path

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.geometry.rotation import matrices_from_quaternions, matrix_from_quaternion
from spin_usd.orbits.attitudes import Aem, Inertial, Listed, Pointing, Sight, Tumbling
from spin_usd.orbits.epochs import EME2000, Epochs
from spin_usd.orbits.orbit_context import OrbitContext
from spin_usd.orbits.propagation import from_relative_state, propagated, state_of

EPOCH = "2024-05-01T12:00:00Z"
POLE = np.array([0.0, 0, 1])
START = state_of(7.078e6, 0.0, 1.71, 0.4, 0.2, 0.3)
EXACT = 1e-9
AEM = """CCSDS_AEM_VERS = 1.0
CREATION_DATE = 2024-05-01T00:00:00
ORIGINATOR = TEST
META_START
OBJECT_NAME = CRAFT
OBJECT_ID = 2024-001A
CENTER_NAME = EARTH
REF_FRAME_A = EME2000
REF_FRAME_B = SC_BODY_1
ATTITUDE_DIR = A2B
TIME_SYSTEM = UTC
START_TIME = 2024-05-01T12:00:00
STOP_TIME = 2024-05-01T12:01:00
ATTITUDE_TYPE = QUATERNION
QUATERNION_TYPE = LAST
META_STOP
DATA_START
{rows}
DATA_STOP
"""


def sight(folder: Path, *seconds: float) -> Sight:
    epochs = Epochs(EPOCH, np.array(seconds, float))
    own = propagated(from_relative_state(START, np.array([0, -100.0, 5]), np.zeros(3)), epochs.seconds, POLE)
    return Sight(
        context=OrbitContext(epochs=epochs, folder=folder), own=own, other=propagated(START, epochs.seconds, POLE)
    )


@pytest.mark.parametrize("at", ["target", "nadir", "zenith", "sun", "moon", "velocity", "orbit_normal", (1, 2, 3)])
def test_an_axis_points_at_what_it_should(tmp_path: Path, at) -> None:
    seen = sight(tmp_path, 0.0, 700.0)
    towards = "velocity" if at in ("nadir", "zenith") else "nadir"
    turns = Pointing(axis=(0, 0, 1), at=at, second=(0, 1, 0), towards=towards).rotations(seen)
    looked = turns[:, :, 2]
    place = seen.own[:, :3]
    known = {
        "target": seen.other[:, :3] - place,
        "nadir": -place,
        "zenith": place,
        "sun": seen.context.epochs.sun - place,
        "moon": seen.context.epochs.moon - place,
        "velocity": seen.own[:, 3:],
        "orbit_normal": np.cross(place, seen.own[:, 3:]),
    }
    wanted = known[at] if isinstance(at, str) else np.tile(at, (2, 1))
    assert looked == pytest.approx(wanted / np.linalg.norm(wanted, axis=1, keepdims=True), abs=EXACT)
    second = known[towards] / np.linalg.norm(known[towards], axis=1, keepdims=True)
    across = second - (second * looked).sum(1, keepdims=True) * looked
    assert turns[:, :, 1] == pytest.approx(across / np.linalg.norm(across, axis=1, keepdims=True), abs=EXACT)
    assert np.linalg.det(turns) == pytest.approx(1)


def test_axes_that_are_not_the_cameras_point_too(tmp_path: Path) -> None:
    seen = sight(tmp_path, 0.0)
    turn = Pointing(axis=(1, 1, 0), at="sun", second=(0, 0, -2), towards="nadir").rotations(seen)[0]
    sun = seen.context.epochs.sun[0] - seen.own[0, :3]
    assert turn @ np.array([1, 1, 0]) / np.sqrt(2) == pytest.approx(sun / np.linalg.norm(sun), abs=EXACT)


@pytest.mark.parametrize(("axis", "second"), [((0, 0, 1), (0, 0, 2)), ((0, 0, 0), (0, 1, 0))])
def test_axes_that_fix_no_attitude_are_told(tmp_path: Path, axis, second) -> None:
    with pytest.raises(InputError, match="which are parallel, or 0"):
        Pointing(axis=axis, at="sun", second=second).rotations(sight(tmp_path, 0.0))
    with pytest.raises(InputError, match=r"points at nadir and towards zenith, which are parallel .*at second 0"):
        Pointing(at="nadir", towards="zenith").rotations(sight(tmp_path, 0.0))


def test_an_aem_means_what_ccsds_says(tmp_path: Path) -> None:
    """Its quaternion takes coordinates in EME2000 to the craft's: a quarter turn about z takes the frame's x axis to
    minus the craft's y, and the craft's x axis is the frame's y."""
    half = np.sqrt(0.5)
    rows = "\n".join(f"2024-05-01T12:00:{second:02d} 0 0 {half!r} {half!r}" for second in (0, 30))
    (tmp_path / "craft.aem").write_text(AEM.format(rows=rows).replace("np.float64(", "").replace(")", ""))
    seen = sight(tmp_path, 0.0, 10.0)
    turns = Aem(file="craft.aem").rotations(seen)
    bias = seen.context.epochs.axes_of(EME2000)[0]
    assert turns[:, :, 0] == pytest.approx(np.tile(bias[:, 1], (2, 1)), abs=EXACT)
    text = (tmp_path / "craft.aem").read_text().replace("QUATERNION_TYPE = LAST\n", "")
    second = text.replace("VERS = 1.0", "VERS = 2.0").replace("ATTITUDE_DIR = A2B\n", "")
    (tmp_path / "second.aem").write_text(second)
    assert np.array_equal(Aem(file="second.aem").rotations(seen), turns)
    (tmp_path / "second.aem").write_text(second.replace("ATTITUDE_TYPE", "ATTITUDE_DIR = B2A\nATTITUDE_TYPE"))
    with pytest.raises(InputError, match="is of version 2, and has ATTITUDE_DIR = B2A, which only version 1 means"):
        Aem(file="second.aem").rotations(seen)
    swapped = (tmp_path / "craft.aem").read_text().replace("ATTITUDE_DIR = A2B", "ATTITUDE_DIR = B2A")
    (tmp_path / "craft.aem").write_text(swapped)
    assert Aem(file="craft.aem").rotations(seen)[0, :, 0] == pytest.approx(-bias[:, 1], abs=EXACT)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("SC_BODY_1", "ICRF"), "not just one is a frame of the craft"),
        (("0 0 0 1", "0 0 0 2"), "norm 2, expected 1"),
        (("EME2000", "RTN"), "frame 'RTN'"),
        (
            ("ATTITUDE_TYPE = QUATERNION\n", "ATTITUDE_TYPE = QUATERNION/RATE\n"),
            "has attitudes of the type QUATERNION/R",
        ),
        (("ATTITUDE_TYPE = QUATERNION\n", ""), "does not state ATTITUDE_TYPE; add it"),
        (("ATTITUDE_TYPE = QUATERNION\n", "ATTITUDE_TYPE =\n"), "line 14: has the ATTITUDE_TYPE '', which CCSDS"),
        (("TIME_SYSTEM = UTC", "TIME_SYSTEM = U"), "line 11: has the TIME_SYSTEM 'U', which CCSDS does not define"),
        (("12:00:30 0 0 0 1", "12:00:30 0 0 0"), "line 19: has 3 numbers after its epoch, expected 4"),
        (("12:00:30 0 0 0 1", "12:00:30 0 0 x 1"), "line 19: contains 'x', which is not a finite number"),
        (("_AEM_", "_OEM_"), "is a CCSDS OEM, not an AEM; give it as an orbit"),
        (("START_TIME", "USEABLE_START_TIME = 2024-05-01T12:00:10\nSTART_TIME"), "has no state at second 0"),
        (("REF_FRAME_A = EME2000\n", ""), "does not state REF_FRAME_A"),
    ],
)
def test_an_aem_that_cannot_be_used_is_told(tmp_path: Path, change, says: str) -> None:
    rows = "2024-05-01T12:00:00 0 0 0 1\n2024-05-01T12:00:30 0 0 0 1"
    (tmp_path / "craft.aem").write_text(AEM.format(rows=rows).replace(*change))
    with pytest.raises(InputError, match=says):
        Aem(file="craft.aem").rotations(sight(tmp_path, 0.0))


def test_one_attitude_of_several_is_chosen(tmp_path: Path) -> None:
    first = AEM.format(rows="2024-05-01T12:00:00 0 0 0 1\n2024-05-01T12:00:30 0 0 0 1")
    second = first[first.index("META_START") :].replace("CRAFT", "OTHER").replace("0 0 0 1", "0 0 1 0")
    (tmp_path / "craft.aem").write_text(first + second)
    seen = sight(tmp_path, 0.0)
    with pytest.raises(InputError, match=r"is of CRAFT \(2024-001A\), OTHER \(2024-001A\); name one"):
        Aem(file="craft.aem").rotations(seen)
    turned = Aem(file="craft.aem", craft="OTHER").rotations(seen)[0]
    assert turned == pytest.approx(Epochs(EPOCH, np.zeros(1)).axes_of(EME2000)[0] @ np.diag([-1, -1, 1]), abs=EXACT)


def test_a_list_is_smooth_between_its_lines(tmp_path: Path) -> None:
    """A steady turn of 3 degrees a second is one between lines 10 s apart."""
    times = np.arange(0, 61, 10)
    half = np.radians(3.0 * times) / 2
    lines = ["time,w,x,y,z", *(f"{t},{np.cos(h):.12f},0,{np.sin(h):.12f},0" for t, h in zip(times, half, strict=True))]
    (tmp_path / "turns.csv").write_text("\n".join(lines))
    (turn,) = Listed(file="turns.csv").rotations(sight(tmp_path, 34.0))
    angle = np.radians(3.0 * 34) / 2
    assert turn == pytest.approx(matrix_from_quaternion([np.cos(angle), 0, np.sin(angle), 0]), abs=1e-9)
    with pytest.raises(InputError, match="has no state at second 70"):
        Listed(file="turns.csv").rotations(sight(tmp_path, 70.0))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("0 1 0 0 0\n1 1 0 0\n", "line 2: does not have five finite numbers"),
        ("0 1 0 0 0\n1 one 0 0 0\n", "line 2: contains text that is not a number"),
        ("0 1 0 0 0\n", "has 1 state; give two or more"),
        ("5 1 0 0 0\n4 1 0 0 0\n", "goes back by 1 s at state 2"),
    ],
)
def test_a_list_that_is_wrong_is_told(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "turns.csv").write_text(text)
    with pytest.raises(InputError, match=says):
        Listed(file="turns.csv").rotations(sight(tmp_path, 0.0))


def test_what_is_inertial_stays(tmp_path: Path) -> None:
    turns = Inertial(q=(0.6, 0.8, 0, 0)).rotations(sight(tmp_path, 0.0, 1000.0))
    assert turns == pytest.approx(np.tile(matrix_from_quaternion([0.6, 0.8, 0, 0]), (2, 1, 1)))
    with pytest.raises(InputError, match="norm 2"):
        Inertial(q=(2, 0, 0, 0)).rotations(sight(tmp_path, 0.0))


def test_what_tumbles_keeps_its_momentum_before_the_start_too(tmp_path: Path) -> None:
    inertia, rate, step = np.diag([20.0, 30, 40]), np.array([2.0, 5, -3]), 1e-3
    tumbling = Tumbling(q=(0.6, 0.8, 0, 0), rate_deg_s=tuple(rate), inertia=(20, 30, 40))
    momenta = []
    for second in (-40.0, 0.0, 90.0):
        before, now, after = tumbling.rotations(sight(tmp_path, second - step, second, second + step))
        turned = (after @ before.T - before @ after.T) / 2
        own_rate = np.array([turned[2, 1], turned[0, 2], turned[1, 0]]) / (2 * step)
        momenta.append(now @ inertia @ now.T @ own_rate)
    first = matrices_from_quaternions(np.array([0.6, 0.8, 0, 0])) @ inertia @ np.radians(rate)
    assert np.array(momenta) == pytest.approx(np.tile(first, (3, 1)), rel=1e-5, abs=1e-5)

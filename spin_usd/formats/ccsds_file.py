"""CCSDS navigation messages, as KVN or XML: orbit ephemerides (OEM) and attitude ephemerides (AEM).

Source: CCSDS 502.0-B (orbit data messages) and 504.0-B (attitude data messages).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import FETCH_AGAIN, decoding
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.formats.text_file import is_finite, line_at, lines_in, read_any_text
from spin_usd.formats.xml_elements import XmlElement, xml_elements

KM = 1e3
AS_READ = (
    (r"(CCSDS_OEM_VERS\s*=\s*)1\.0", r"\g<1>2.0"),  # which has all of it
    (r"(CCSDS_AEM_VERS\s*=\s*)2\.0", r"\g<1>1.0"),
)
"""Message versions that ccsds-ndm does not read, and versions with the same lines that it reads."""
OF_AEM_2 = (
    (r"(?m)^(TIME_SYSTEM\s*=)", r"ATTITUDE_DIR = A2B\n\1"),
    (r"(?m)^(ATTITUDE_TYPE\s*=.*)$", r"\1\nQUATERNION_TYPE = LAST"),
)
"""Lines that version 2 of an AEM implies and version 1 requires."""
OF_AEM_1 = re.compile(r"(?m)^(?:ATTITUDE_DIR\s*=\s*B2A|QUATERNION_TYPE\s*=\s*FIRST)")
"""Lines that contradict those."""
ATTITUDES = re.compile(r"(?i)ATTITUDE_TYPE\s*[=>][^\S\n]*(?!QUATERNION\s*(?:<|$))([A-Z][A-Z_/ ]*[A-Z])", re.MULTILINE)
"""A type of attitude that is not read."""
NUMBERS = {"OEM": (6, 9), "AEM": (4,)}
"""Counts of numbers after an epoch; an OEM may have accelerations."""
SPACECRAFT = "SC_"  # how the names of a craft's own axes begin
LARGEST = 1e15  # metres, beyond any orbit
BLOCKS = {"header", "body", "segment", "metadata", "data", "quaternion"}  # of XML; all else is in capitals
VERSION = re.compile(r"CCSDS_([A-Z]{3})_VERS")
STATE = re.compile(r"\d{4}-\d[^=\s]*(?:\s+[^=\s]+)+$")
"""A line of KVN with an epoch and its numbers."""
OTHERS = {"an SP3 orbit": r"#[a-d][PV]\d{4}", "a CPF prediction": r"H1 +CPF", "an ephemeris of STK": r"stk\.v\."}
"""Ephemerides that are no CCSDS messages, by how they begin."""
INSTEAD = {
    "OMM": "give it as an orbit of kind tle",
    "OPM": "give its state as an orbit of kind state",
    "OEM": "give it as an orbit of kind oem",
    "AEM": "give it as an attitude of kind aem",
}
"""Remedies for messages of another kind."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EphemerisSegment:
    """A part of a message with one frame and one time system."""

    frame: str
    time_system: str
    times: tuple[str, ...]
    rows: Float
    """(N, 6) places and velocities, metres; or (N, 4) quaternions, scalar first, whose active rotation takes the
    craft's axes to the frame's."""
    useable: tuple[str | None, str | None]
    """First and last time of use, None for those of the states."""


def read_oem(path: Path, craft: str | None = None) -> list[EphemerisSegment]:
    """Read the segments of an orbit ephemeris, of the craft of that name or id. Raises InputError."""
    segments = []
    for segment in _segments(path, "OEM", craft):
        about = segment.metadata
        if (centre := _stated(about, "center_name", path).upper()) != "EARTH":
            raise InputError(f"is about {centre}", where=path, do="give an orbit about the Earth")
        states = segment.data.state_vector
        rows = [[_number(x) for x in (s.x, s.y, s.z, s.x_dot, s.y_dot, s.z_dot)] for s in states]
        with np.errstate(over="ignore"):  # refused by its size
            metres = np.array(rows, np.float64).reshape(-1, 6) * KM
        segments.append(_segment(_stated(about, "ref_frame", path), about, [s.epoch for s in states], metres, path))
    return segments


def read_aem(path: Path, craft: str | None = None) -> list[EphemerisSegment]:
    """Read the segments of an attitude ephemeris of quaternions, of the craft of that name or id. Raises InputError for
    other types."""
    return [_attitudes(segment, path) for segment in _segments(path, "AEM", craft)]


def _number(value: Any) -> float:
    """Return a number, with or without a unit; NaN for what is not one."""
    try:
        return float(getattr(value, "value", value))
    except (TypeError, ValueError):
        return np.nan


def _attitudes(segment: Any, path: Path) -> EphemerisSegment:
    about = segment.metadata
    _stated(about, "attitude_type", path)
    given = segment.data.attitude_state
    states = [each.quaternion_state for each in given if getattr(each, "quaternion_state", None)]
    if len(states) < len(given):
        raise InputError("has states that are not quaternions", where=path, do="give quaternions")
    frames = [_stated(about, name, path) for name in ("ref_frame_a", "ref_frame_b")]
    if _stated(about, "attitude_dir", path) == "B2A":
        frames.reverse()
    own = [name.upper().startswith(SPACECRAFT) for name in frames]
    if sum(own) != 1:
        found = f"turns {frames[0]} to {frames[1]}, of which not just one is a frame of the craft (SC_BODY_1)"
        raise InputError(found, where=path, do="name both frames as CCSDS does")
    # A message's quaternion takes coordinates in its first frame to the second: its active rotation goes back.
    sign = 1 if own[1] else -1
    rows = np.array([[_number(x) for x in (q.qc, q.q1, q.q2, q.q3)] for q in (state.quaternion for state in states)])
    rows = rows.reshape(-1, 4) * [1, sign, sign, sign]
    return _segment(frames[not own[1]], about, [state.epoch for state in states], rows, path)


def _segment(frame: str, about: Any, times: list[str], rows: Float, path: Path) -> EphemerisSegment:
    if not len(rows):
        raise InputError("has a segment without states", where=path)
    if len(bad := np.flatnonzero(~(np.abs(rows) < LARGEST).all(1))):
        found = f"has the state of {times[bad[0]]}, which is not complete, or too large"
        raise InputError(found, where=path, do="mend it")
    useable = (about.useable_start_time, about.useable_stop_time)
    system = _stated(about, "time_system", path)
    return EphemerisSegment(frame=frame, time_system=system, times=tuple(times), rows=rows, useable=useable)


def _stated(about: Any, name: str, path: Path) -> str:
    """Return a value of the metadata. Raises InputError."""
    value = getattr(about, name)
    if value in (None, ""):
        raise InputError(f"does not state {name.upper()}", where=path, do="add it")
    return str(getattr(value, "value", value))


def _segments(path: Path, kind: str, craft: str | None) -> list[Any]:
    """Return the segments of one craft in a message of that kind. Raises InputError."""
    from ccsds_ndm.ndm_io import NdmIo  # not above: an extra

    text = read_any_text(path, MAX_DOCUMENT)
    _check_kind(text, kind, path)
    if other := ATTITUDES.search(text):  # ccsds-ndm does not know all
        raise InputError(f"has attitudes of the type {other[1]}", where=path, do="give quaternions")
    _check_numbers(text, kind, path)
    of_second = re.search(r"CCSDS_AEM_VERS\s*=\s*2\.", text)
    if of_second and (line := OF_AEM_1.search(text)):
        found = f"is of version 2, and has {line[0]}, which only version 1 means"
        raise InputError(found, where=path, do="write the version that its lines are of")
    for pattern, instead in (*AS_READ, *(OF_AEM_2 if of_second else ())):
        text = re.sub(pattern, instead, text)
    elements = xml_elements(text, path) if text.lstrip().startswith("<") else []
    try:
        with decoding(path):
            message = NdmIo().from_string(text)
    except InputError as error:
        raise _misplaced(error.found, kind, text, elements, path) from None
    if type(message).__name__.upper() != kind:
        found = f"holds more than one CCSDS {kind}"
        raise InputError(found, where=path, do="give one message, as KVN or XML")
    segments = [((str(each.metadata.object_name), str(each.metadata.object_id)), each) for each in message.body.segment]
    if not segments:
        raise InputError("has no whole segment", where=path, do="copy it again")
    chosen = [(names, segment) for names, segment in segments if craft is None or craft in names]
    if len({names for names, _ in chosen}) != 1:
        listed = ", ".join(f"{name} ({number})" for name, number in dict.fromkeys(names for names, _ in segments))
        raise InputError(f"is of {listed}", where=path, do='name one of them, as object = "NAME"')
    return [segment for _, segment in chosen]


def _check_kind(text: str, kind: str, path: Path) -> None:
    """Raise InputError for other messages."""
    if not (version := VERSION.search(text)):
        others = (name for name, begins in OTHERS.items() if re.match(begins, text.lstrip()))
        raise InputError(
            f"is {next(others, 'not a CCSDS message')}", where=path, do=f"convert it to an {kind}, as KVN or XML"
        )
    if version[1] != kind:
        do = INSTEAD.get(version[1], f"give an {kind}, as KVN or XML")
        raise InputError(f"is a CCSDS {version[1]}, not an {kind}", where=path, do=do)
    first = text.strip().partition("\n")[0]
    if not first.startswith(("<", "CCSDS_")):
        found = f"begins with {first[:40]!r}, not with CCSDS_{kind}_VERS"
        raise InputError(found, where=path, do="remove what is before it")


def _check_numbers(text: str, kind: str, path: Path) -> None:
    """Raise InputError for a state in a line of KVN that is not the right count of finite numbers."""
    for number, line in enumerate(lines_in(text, path), 1):
        words = line.split() if STATE.match(line.strip()) else []
        if bad := next((word for word in words[1:] if not is_finite(word)), None):
            found = f"contains {bad!r}, which is not a finite number"
            raise InputError(found, where=f"{path}, line {number}", do="mend the line")
        if words and len(words) - 1 not in NUMBERS[kind]:
            found = f"has {len(words) - 1} numbers after its epoch, expected {NUMBERS[kind][0]}"
            raise InputError(found, where=f"{path}, line {number}", do="mend the line")


def _misplaced(said: str, kind: str, text: str, elements: Sequence[XmlElement], path: Path) -> InputError:
    """Return the error, in our words, for a message that ccsds-ndm refused in the words `said`."""
    version = re.search(rf'CCSDS_{kind}_VERS(?:"\s+version)?[^\S\n]*=[^\S\n]*"?([^\n"]*)', text)
    found = f"cannot be read as a CCSDS {kind} of version {version[1] if version else 'unknown'}"
    lines: list[int] = []
    if value := re.search(r"'(.*)' is not a valid", said):
        pattern = rf"(\w*(?:_DIR|_TYPE|_SYSTEM|FRAME\w*))\s*[=>][^\S\n]*{re.escape(value[1])}[^\S\n]*(?:\n|<)"
        if key := re.search(pattern, text):
            found, lines = f"has the {key[1]} {value[1]!r}, which CCSDS does not define", [line_at(text, key.start())]
    elif extra := re.search(r"Unknown property (\w+):(\w+)", said):
        found = f"has {extra[2]} twice, or where CCSDS does not define it"
        of = extra[1].lower()  # such as oemMetadata
        named = [each for each in elements if each.name == extra[2] and each.around.lower() in of]
        lines = [each.line for each in named if each.again] or [each.line for each in named]
    elif lacking := re.search(r"missing \d+ required .*?: '(\w+)'", said):
        name = lacking[1] if lacking[1] in BLOCKS else lacking[1].upper()
        found = f"does not state {name}"
        around = {each.around for each in elements if each.name == name}
        lines = [each.line for each in elements if each.name in around and name not in each.children]
    return InputError(found, where=f"{path}, line {lines[0]}" if lines else path, do=FETCH_AGAIN)

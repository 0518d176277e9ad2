"""CCSDS navigation messages, as KVN or XML: orbit ephemerides (OEM) and attitude ephemerides (AEM).

Source: CCSDS 502.0-B (orbit data messages) and 504.0-B (attitude data messages).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.formats.text_file import read_any_text

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
SPACECRAFT = "SC_"  # how the names of a craft's own axes begin


@dataclass(frozen=True, kw_only=True, eq=False)
class EphemerisSegment:
    """A part of a message with one frame and one time system."""

    frame: str
    time_system: str
    times: tuple[str, ...]
    rows: Float
    """(N, 6) places and velocities, metres; or (N, 4) quaternions, scalar first, whose active rotation takes the
    craft's axes to the frame's."""


def read_oem(path: Path) -> list[EphemerisSegment]:
    """Read the segments of an orbit ephemeris. Raises InputError."""
    segments = []
    for segment in _segments(path, "Oem"):
        about = segment.metadata
        if (centre := str(about.center_name).upper()) != "EARTH":
            raise InputError(f"is about {centre}", where=path, do="give an orbit about the Earth")
        states = segment.data.state_vector
        rows = [[x.value for x in (s.x, s.y, s.z, s.x_dot, s.y_dot, s.z_dot)] for s in states]
        segments.append(_segment(str(about.ref_frame), about, [s.epoch for s in states], np.array(rows) * KM, path))
    return segments


def read_aem(path: Path) -> list[EphemerisSegment]:
    """Read the segments of an attitude ephemeris of quaternions. Raises InputError for other types."""
    return [_attitudes(segment, path) for segment in _segments(path, "Aem")]


def _attitudes(segment: Any, path: Path) -> EphemerisSegment:
    about = segment.metadata
    given = segment.data.attitude_state
    states = [each.quaternion_state for each in given if getattr(each, "quaternion_state", None)]
    if len(states) < len(given):
        kind = str(getattr(about.attitude_type, "value", about.attitude_type))
        raise InputError(f"has attitudes of the type {kind}", where=path, do="give quaternions")
    frames = [str(about.ref_frame_a), str(about.ref_frame_b)]
    direction = str(getattr(about.attitude_dir, "value", about.attitude_dir))
    if direction == "B2A":
        frames.reverse()
    own = [name.upper().startswith(SPACECRAFT) for name in frames]
    if sum(own) != 1:
        found = f"turns {frames[0]} to {frames[1]}, of which not just one is a frame of the craft (SC_BODY_1)"
        raise InputError(found, where=path, do="name both frames as CCSDS does")
    # A message's quaternion takes coordinates in its first frame to the second: its active rotation goes back.
    sign = 1 if own[1] else -1
    rows = [[q.qc, sign * q.q1, sign * q.q2, sign * q.q3] for q in (state.quaternion for state in states)]
    return _segment(frames[not own[1]], about, [state.epoch for state in states], np.array(rows), path)


def _segment(frame: str, about: Any, times: list[str], rows: Float, path: Path) -> EphemerisSegment:
    if not (len(rows) and np.isfinite(rows).all()):
        raise InputError("has a segment without states, or with states that are not finite", where=path)
    system = str(getattr(about.time_system, "value", about.time_system))
    return EphemerisSegment(frame=frame, time_system=system, times=tuple(times), rows=rows)


def _segments(path: Path, kind: str) -> Iterator[Any]:
    from ccsds_ndm.ndm_io import NdmIo  # not above: an extra

    text = read_any_text(path, MAX_DOCUMENT)
    of_second = re.search(r"CCSDS_AEM_VERS\s*=\s*2\.", text)
    for pattern, instead in (*AS_READ, *(OF_AEM_2 if of_second else ())):
        text = re.sub(pattern, instead, text)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError("defines entities, which no message needs", where=path, do="remove its DOCTYPE")
    with decoding(path):
        message = NdmIo().from_string(text)
    if type(message).__name__ != kind:
        raise InputError(f"is not a CCSDS {kind.upper()}", where=path, do="give one, as KVN or XML")
    yield from message.body.segment

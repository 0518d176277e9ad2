"""Mean elements for SGP4: two-line elements (TLE), and orbit mean-elements messages (OMM) as CSV, JSON, XML or KVN.

Source: CCSDS 502.0-B (OMM); CelesTrak's "A New Way to Obtain GP Data" for CSV and JSON of the same names.
"""

import io
import re
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from spin_usd.basics.faults import decoding
from spin_usd.basics.utc import parsed_utc
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.formats.json_file import read_json_file
from spin_usd.formats.text_file import is_finite, line_at, read_any_text
from spin_usd.formats.xml_elements import xml_elements
from spin_usd.orbits.epochs import calendar

TLE_LINE = re.compile(r"[12] [ 0-9A-Z][ \d]{4}[U0-9A-Z ]? ")
LEFT_OUT = {
    **dict.fromkeys(("EPHEMERIS_TYPE", "ELEMENT_SET_NO", "REV_AT_EPOCH", "MEAN_MOTION_DOT", "MEAN_MOTION_DDOT"), "0"),
    "CLASSIFICATION_TYPE": "U",
    "OBJECT_ID": "",
}
"""Fields of an OMM that SGP4 does not need, and their values where they are missing."""
MEANT = {"CENTER_NAME": "EARTH", "REF_FRAME": "TEME", "TIME_SYSTEM": "UTC", "MEAN_ELEMENT_THEORY": "SGP4"}
"""Values that an OMM of SGP4 has, or leaves out."""
COUNTS = ("EPHEMERIS_TYPE", "ELEMENT_SET_NO", "REV_AT_EPOCH", "NORAD_CAT_ID")
NUMBERS = (
    "MEAN_MOTION", "ECCENTRICITY", "INCLINATION", "RA_OF_ASC_NODE", "ARG_OF_PERICENTER", "MEAN_ANOMALY",
    "BSTAR", "MEAN_MOTION_DOT", "MEAN_MOTION_DDOT",
)  # fmt: skip
KVN_LINE = re.compile(r"(?m)^\s*(\w+)\s*=[^\S\n]*(.*?)[^\S\n]*(?:\[.*)?$")
WHOLE = re.compile(r"^(-?\d+)\.0+$")
"""A whole number as some JSON writers give it."""
SHOWN = 5  # craft in a message
Named = tuple[tuple[str, ...], Callable[[], Any]]
"""Name and number of a craft, and what makes its sgp4.Satrec."""


def read_elements(path: Path, craft: str | None) -> Any:
    """Return the sgp4.Satrec of the craft of that name or number, of the only one if None. Raises InputError."""
    text = read_any_text(path, MAX_DOCUMENT)
    messages = "MEAN_MOTION" in text
    found = list(_messages(text, path) if messages else _two_lines(text, path))
    chosen = [make for names, make in found if craft is None or craft in names]
    if len(chosen) == 1:
        with decoding(path):
            return chosen[0]()
    if not found and "CCSDS_OMM_VERS" in text:
        do = "give an OMM with MEAN_ELEMENT_THEORY SGP4"
        raise InputError("has no mean motion, which SGP4 needs", where=path, do=do)
    if not found:
        do = "give its two lines, with or without its name, or an OMM"
        raise InputError("does not contain one TLE", where=path, do=do)
    listed = ", ".join(dict.fromkeys(" ".join(filter(None, names)) for names, _ in islice(found, SHOWN)))
    do = f'name one craft, as object = "{found[0][0][1]}", and keep only its elements that are nearest in time'
    raise InputError(
        f"contains {len(found)} sets of elements ({listed}{', …' * (len(found) > SHOWN)})", where=path, do=do
    )


def _two_lines(text: str, path: Path) -> Iterator[Named]:
    from sgp4.alpha5 import from_alpha5  # not above: an extra

    lines = [line.rstrip() for line in text.splitlines() if line.strip()]
    for name, first, second in zip(["", *lines], lines, [*lines[1:], ""], strict=False):
        if first[0] == "1" and TLE_LINE.match(first):
            if (
                not TLE_LINE.match(second)
                or second[:1] + first[2:7] != f"2{second[2:7]}"
                or min(len(first), len(second)) < 69
            ):
                do = "give its two lines, each of 69 characters"
                raise InputError("does not contain one TLE", where=path, do=do)
            title = "" if TLE_LINE.match(name) else name.removeprefix("0 ").strip()
            with decoding(path):
                number = str(from_alpha5(first[2:7].replace(" ", "0")))
            yield (title, number), partial(_of_two_lines, first, second, path)


def _of_two_lines(first: str, second: str, path: Path) -> Any:
    from sgp4.api import Satrec
    from sgp4.io import verify_checksum

    try:
        verify_checksum(first, second)
        return Satrec.twoline2rv(first, second)
    except ValueError as error:
        raise InputError(f"is not a valid TLE ({error})", where=path, do="copy it again") from None


def _messages(text: str, path: Path) -> Iterator[Named]:
    from sgp4 import omm

    rows: Any
    if text.lstrip()[:1] in "[{":
        document = read_json_file(path, MAX_DOCUMENT)
        rows = document if isinstance(document, list) else [document]
    elif text.lstrip().startswith("<"):
        rows = _rows_of_xml(text, path)
    elif "=" in text:
        rows = [
            dict(re.findall(r"(?m)^\s*(\w+)\s*=[^\S\n]*(.*?)\s*(?:\[.*)?$", each)) for each in text.split("CCSDS_OMM_")
        ]
    else:
        rows = list(omm.parse_csv(io.StringIO(text)))
    for row in rows:
        if isinstance(row, dict) and "MEAN_MOTION" in row:
            given = {str(key): str(value).strip() for key, value in row.items() if value is not None}
            fields = {key: WHOLE.sub(r"\1", value) for key, value in given.items() if value}
            make = partial(_of_message, fields, text, path)
            yield (fields.get("OBJECT_NAME", ""), fields.get("NORAD_CAT_ID", "")), make


def _rows_of_xml(text: str, path: Path) -> list[dict[str, str]]:
    """Return the fields of each segment of an XML message. Raises InputError."""
    rows: list[dict[str, str]] = []
    for element in xml_elements(text, path):
        if element.name == "segment":
            rows.append({})
        if rows and not element.children:
            rows[-1][element.name] = element.text
    return rows


def _not(key: str, expected: str, fields: Mapping[str, str], text: str, path: Path) -> InputError:
    """Return the error for a field that is not what is expected of it."""
    place = re.search(rf"\b{key}\b.*{re.escape(fields[key])}", text)
    where = f"{path}, line {line_at(text, place.start())}" if place else path
    found = f"has the {key} {fields[key][:40]!r}, expected {expected}"
    return InputError(found, where=where, do="mend it, or fetch the message again")


def _of_message(fields: Mapping[str, str], text: str, path: Path) -> Any:
    from sgp4 import omm
    from sgp4.api import Satrec

    if wrong := next((key for key in MEANT if fields.get(key, MEANT[key]).removeprefix("SGP/") != MEANT[key]), None):
        do = f"give an OMM with {wrong} {MEANT[wrong]}"
        raise InputError(f"has {wrong} {fields[wrong][:40]!r}, not {MEANT[wrong]}", where=path, do=do)
    for key in (each for each in (*COUNTS, *NUMBERS) if each in fields):
        if not is_finite(fields[key]) or (key in COUNTS and not fields[key].lstrip("-").isdecimal()):
            raise _not(key, f"a {'whole ' * (key in COUNTS)}number", fields, text, path)
    craft = Satrec()
    try:
        epoch = parsed_utc(calendar(fields["EPOCH"])).strftime("%Y-%m-%dT%H:%M:%S.%f")
        number = str(int(fields["NORAD_CAT_ID"]) % 100_000)  # SGP4 does not use it, and its field ends at 339,999
        omm.initialize(craft, {**LEFT_OUT, **fields, "EPOCH": epoch, "NORAD_CAT_ID": number})
    except KeyError as error:
        raise InputError(f"has no {error.args[0]}", where=path, do="give an OMM for SGP4") from None
    except ValueError:  # of the epoch, as the numbers are checked
        raise _not("EPOCH", "UTC such as 2024-05-01T12:00:00", fields, text, path) from None
    return craft

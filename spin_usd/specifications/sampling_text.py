"""A sampling specification in one line, such as "range=3..10 attitude=uniform inside=0.9 count=1000".

Its words are those of a file (schemas/sample-1.schema.json): numbers are 5, 3..10 (uniform) or log(3..10), in a unit if
one follows, as 400..800km; directions are X,Y,Z, or X,Y,Z:DEGREES for any within that angle; attitudes are W,X,Y,Z, or
W,X,Y,Z:DEGREES. `uniform` is any direction or attitude.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.formats.text_file import read_toml_file

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
SPAN = re.compile(rf"({NUMBER})\.\.({NUMBER})")
LOG_SPAN = re.compile(rf"log\(({NUMBER})\.\.({NUMBER})\)")
NEAR = re.compile(rf"({NUMBER}(?:,{NUMBER})*)(?::({NUMBER}))?")
WITH_UNIT = re.compile(r"(.*?[\d.)])((?![eE]\d)[A-Za-z/]+\d?)")
UNIFORM = "uniform"
NAMES = "img{picture:06d}"
MAX_PICTURES = 1_000_000
MAX_BODIES = 100  # of one line; each needs its own layer of poses
LOWER = "give the lower number first"
HALF_TURN = 180.0  # degrees

Words = Mapping[str, Any]
DISTANCE = "distance"


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyText:
    """Placement of further bodies, from a line such as "distance=1..5 count=3"."""

    text: str
    count: int
    """Number of the bodies."""
    poses: Words
    """The equivalent table, and `distance`, metres between a body's origin and the target's.

    Empty if not stated.
    """


def is_sampling_text(given: str) -> bool:
    """Return whether `given` is such a line, and not a name or a file."""
    return "=" in given


def sampling_document(text: str, count: int | None = None) -> dict[str, Any]:
    """Return the tables equivalent to `text`; `count` pictures, unless the text states the number. Raises InputError
    with the word."""
    words = _words(text)
    given = _number("count", words.pop("count")) if "count" in words else count
    poses, sample, constraints = _sorted(words)
    if given is None:
        raise InputError("does not state the number of pictures", where=f"sample {text!r}", do="add count=100")
    pictures = _whole(_within("count", given, 1, MAX_PICTURES))
    part = {"name": "sample", "names": NAMES, "pictures": pictures, "poses": poses, "sample": sample}
    return {"schema": "sample-1", "part": [part], "constraints": constraints}


def body_text(text: str) -> BodyText:
    """Return the placement of further bodies from `text`. Raises InputError that names the word."""
    words = _words(text)
    count = _whole(_within("count", _number("count", words.pop("count", "1")), 1, MAX_BODIES))
    poses: dict[str, Any] = {}
    for key, value in words.items():
        if key == DISTANCE:
            poses[key] = _range(key, value)
        elif not _add_pose_word(poses, key, value):
            do = f"use count, {DISTANCE}, {', '.join(POSE_WORDS)}"
            raise InputError("does not state where a body is", where=f"sample {key!r}", do=do)
    places = ("range", "range_diameters", "u_share", "v_share")
    if DISTANCE in poses and (other := next((name for name in places if name in poses), None)):
        raise InputError(f"is given beside {DISTANCE}", where=f"sample {other!r}", do="keep one of them")
    return BodyText(text=text, count=count, poses=poses)


def _words(text: str) -> dict[str, str]:
    words: dict[str, str] = {}
    for word in text.split():
        key, equals, value = word.partition("=")
        if not (key and equals and value):
            raise InputError(f"{word!r} is not key=value", where="sample", do="write for example range=3..10 count=100")
        if key in words:
            raise InputError("is given twice", where=f"sample {key!r}", do="keep one of them")
        words[key] = value
    return words


def _sorted(words: Mapping[str, str]) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Return the distribution of poses, the other samples of each picture, and the constraints."""
    poses: dict[str, Any] = {}
    sample: dict[str, Any] = {}
    constraints: dict[str, Any] = {}
    for key, value in words.items():
        if _add_pose_word(poses, key, value):
            continue
        if key.endswith("_deg"):
            constraints[key] = _within(key, _number(key, value), 0, HALF_TURN)
        elif "." in key:
            sample[key] = {**_sampled(key, value), "per": "frame"}
        else:
            raise InputError("is not known", where=f"sample {key!r}", do=f"use {', '.join(POSE_WORDS)}, {OTHERS}")
    return {"attitude": {"distribution": "attitudes"}, **poses}, sample, constraints


def _add_pose_word(poses: dict[str, Any], key: str, value: str) -> bool:
    """Add the word to the table of `poses`; return whether it belongs there."""
    if key not in POSE_WORDS:
        return False
    name, read = POSE_WORDS[key]
    if name in poses:
        raise InputError("is given beside attitude", where=f"sample {key!r}", do="keep one of them")
    poses[name] = read(key, value)
    return True


OTHERS = "count, a parameter such as sun.direction, or a constraint such as target_lit_deg"


def _numbers(key: str, value: str) -> Words:
    """Return a distribution of numbers."""
    if found := SPAN.fullmatch(value):
        low, high = _span(key, found)
        return {"distribution": UNIFORM, "low": low, "high": high}
    if found := LOG_SPAN.fullmatch(value):
        low, high = _span(key, found)
        if low <= 0:
            raise InputError(f"{value!r} contains {low:g}", where=f"sample {key!r}", do="give log() numbers above 0")
        return {"distribution": "log_uniform", "low": low, "high": high}
    return {"distribution": "fixed", "value": _number(key, value)}


def _range(key: str, value: str) -> Words:
    """Return a distribution of ranges."""
    words = _numbers(key, value)
    least = words.get("low", words.get("value"))
    if least <= 0:
        raise InputError(f"{value!r} contains {least:g}", where=f"sample {key!r}", do="give numbers above 0")
    return words


def _attitude(key: str, value: str) -> Words:
    if value == UNIFORM:
        return {"distribution": "attitudes"}
    around, most = _near(key, value, 4, "W,X,Y,Z or W,X,Y,Z:DEGREES")
    if most is None:
        return {"distribution": "fixed", "value": around}
    return {"distribution": "attitudes_around", "around": around, "most": most}


def _facing(key: str, value: str) -> Words:
    axis, most = _near(key, value, 3, "X,Y,Z:DEGREES, an axis of the body")
    return {"distribution": "facing", "axis": axis, "most": most or 0.0}


def _inside(key: str, value: str) -> float | list[float]:
    found = SPAN.fullmatch(value)
    shares = [_within(key, share, 0, 1) for share in (_span(key, found) if found else [_number(key, value)])]
    return shares if found else shares[0]


def _sampled(key: str, value: str) -> Words:
    """Return a distribution of the parameter `key`, of the kind of value that it takes."""
    from spin_usd.stage.augment.parameter import ATTITUDE, NUMBER, TRUTH  # not above: they load USD
    from spin_usd.stage.augment.parameters import parameter_named

    parameter = parameter_named(key)
    if parameter.kind == TRUTH:
        if value not in ("true", "false"):
            raise InputError(f"{value!r} is not true or false", where=f"sample {key!r}", do="write one of them")
        return {"distribution": "fixed", "value": value == "true"}
    if parameter.kind == ATTITUDE:
        return _attitude(key, value)
    if parameter.kind == NUMBER:
        found = WITH_UNIT.fullmatch(value)
        numbers, unit = found.groups() if found else (value, parameter.unit)
        return {**_numbers(key, numbers), **({"unit": unit} if unit else {})}
    if value == UNIFORM:
        return {"distribution": "directions"}
    axis, most = _near(key, value, 3, "X,Y,Z or X,Y,Z:DEGREES")
    return {"distribution": "directions", "axis": axis, "most": most or 0.0}


def _near(key: str, value: str, count: int, form: str) -> tuple[list[float], float | None]:
    """Return `count` numbers, and the largest angle in degrees between them and a sample; None if not stated."""
    found = NEAR.fullmatch(value)
    numbers = [_number(key, number) for number in found[1].split(",")] if found else []
    if found is None or len(numbers) != count:
        raise InputError(f"{value!r} is not {form}", where=f"sample {key!r}", do=f"write so, or {key}={UNIFORM}")
    if not any(numbers):
        raise InputError(f"{value!r} is all zeros", where=f"sample {key!r}", do="change one of the numbers")
    return numbers, None if found[2] is None else _within(key, _number(key, found[2]), 0, HALF_TURN)


def _span(key: str, found: re.Match[str]) -> list[float]:
    """Return both ends of a span."""
    low, high = (_number(key, found[i]) for i in (1, 2))
    if low > high:
        raise InputError(f"no number lies between {low:g} and {high:g}", where=f"sample {key!r}", do=LOWER)
    return [low, high]


def _within(key: str, number: float, least: float, most: float) -> float:
    if not least <= number <= most:
        found = f"{number:g} is not from {least:g} to {most:.7g}"
        raise InputError(found, where=f"sample {key!r}", do="write a number in this range")
    return number


def _number(key: str, value: str) -> float:
    if not re.fullmatch(NUMBER, value):
        do = "give one number" if SPAN.fullmatch(value) else "write a number, or LOW..HIGH where numbers are sampled"
        raise InputError(f"{value!r} is not a number", where=f"sample {key!r}", do=do)
    number = float(value)
    if not isfinite(number):
        raise InputError(f"{value!r} is too large a number", where=f"sample {key!r}", do="write a smaller one")
    return number


def _whole(number: float) -> int:
    if not float(number).is_integer():
        raise InputError(f"{number:g} is not a whole number", where="sample 'count'", do="write for example count=100")
    return int(number)


POSE_WORDS: Mapping[str, tuple[str, Callable[[str, str], Any]]] = {
    "range": ("range", _range),
    "range_diameters": ("range_diameters", _range),
    "attitude": ("attitude", _attitude),
    "facing": ("attitude", _facing),
    "inside": ("inside", _inside),
    "u_share": ("u_share", _numbers),
    "v_share": ("v_share", _numbers),
}
"""The words for poses: each with its key of the table, and the reader of its value."""


def read_sampling_file(path: str | Path) -> dict[str, Any]:
    """Read the tables of the file at `path`, not yet validated against their schema. Raises InputError that names the
    file."""
    return read_toml_file(Path(path), MAX_SPECIFICATION)

"""The table `sample` of a specification: the distribution of each parameter, as written."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

FRAME = "frame"


@dataclass(frozen=True, kw_only=True)
class SampleEntry:
    """The distribution of one parameter: `words` name it and its numbers, in `unit`."""

    parameter: str
    words: Mapping[str, Any]
    unit: str | None = None
    per_frame: bool = False


def samples_of(table: Mapping[str, Mapping[str, Any]]) -> tuple[SampleEntry, ...]:
    """Return a `sample` table: parameter -> its distribution, with `unit` and `per` among the distribution's own
    words."""
    return tuple(
        SampleEntry(
            parameter=name,
            words={key: value for key, value in words.items() if key not in ("unit", "per")},
            unit=words.get("unit"),
            per_frame=words.get("per") == FRAME,
        )
        for name, words in table.items()
    )

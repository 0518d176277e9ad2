"""Values of all pictures, one column each, by which the page filters, sorts and counts."""

from array import array
from collections.abc import Iterator
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

MAX_COLUMNS = 1000  # records of a dataset have some 200; only a hostile one has more
MAX_WORDS = 1000  # different texts in a column; a column with more, such as a digest, is useless as a filter
MAX_TEXT = 200  # characters of one


class Column(NamedTuple):
    """A column of the page's table."""

    numbers: NDArray[Any]
    """One of each picture, NaN where it has none. In a column of text they are places in `words`, -1 for none."""
    words: tuple[str, ...]


class Columns:
    """Columns by name, which grow a picture at a time."""

    def __init__(self) -> None:
        self._numbers: dict[str, array[float]] = {}
        self._texts: dict[str, array[int]] = {}
        self._words: dict[str, dict[str, int]] = {}
        self._rows = 0

    def add(self, values: dict[str, float | str]) -> None:
        """Add a picture with these values by the columns' names."""
        for name, value in values.items():
            if isinstance(value, str):
                self._add_text(name, value)
            elif self._has(self._numbers, name, "d", nan):
                self._numbers[name].append(float(value) if abs(value) < 1e300 else nan)
        self._rows += 1
        for numbers in self._numbers.values():
            if len(numbers) < self._rows:
                numbers.append(nan)
        for texts in self._texts.values():
            if len(texts) < self._rows:
                texts.append(-1)

    def _add_text(self, name: str, value: str) -> None:
        if self._has(self._texts, name, "i", -1):
            words = self._words.setdefault(name, {})
            text = value[:MAX_TEXT]
            if text in words or len(words) <= MAX_WORDS:
                self._texts[name].append(words.setdefault(text, len(words)))

    def _has(self, columns: dict[str, Any], name: str, typecode: str, none: float) -> bool:
        """Return whether there is a column of that name, which is added if there is room."""
        if name not in columns and len(self._numbers) + len(self._texts) < MAX_COLUMNS:
            columns[name] = array(typecode, [none]) * self._rows
        return name in columns

    def columns(self) -> Iterator[tuple[str, Column]]:
        """Yield the columns by name, numbers first, except texts with too many different values."""
        for name, numbers in self._numbers.items():
            yield name, Column(_compact(np.array(numbers)), ())
        for name, texts in self._texts.items():
            words = tuple(self._words.get(name, ()))
            if 0 < len(words) <= MAX_WORDS:
                yield name, Column(np.array(texts, np.int32), words)


def _compact(numbers: NDArray[np.float64]) -> NDArray[Any]:
    """Return the numbers as float32, but for whole ones that this does not hold."""
    whole = np.isfinite(numbers) & (np.abs(numbers) > 2**24) & (np.rint(numbers) == numbers)
    return numbers if whole.any() else numbers.astype(np.float32)


def leaves(value: Any, name: str = "") -> Iterator[tuple[str, float | str]]:
    """Yield the numbers and texts in a JSON value by names such as targets[0].box.visible[2]; True is 1."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list):
        for place, inner in enumerate(value):
            yield from leaves(inner, f"{name}[{place}]")
    elif isinstance(value, str) or (isinstance(value, int | float) and isfinite(value)):
        yield name, value

"""The JSON of a glTF file by typed look-ups. All access goes through here, so a value of a wrong type always gives one
sentence with its place."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from spin_usd.basics.nesting import parsed_json
from spin_usd.errors import InputError

MEND = "export the model again"
SHOWN = 40  # characters of an invalid value


@dataclass(frozen=True, eq=False)
class JsonObject:
    """An object in the file, which stands at `place` in it, such as materials[3].extensions; "" for the file itself.

    A value that is null is taken as absent. All look-ups raise InputError for a value of another type.
    """

    file: Path
    place: str
    _values: dict[str, Any]

    def __contains__(self, name: str) -> bool:
        return self._values.get(name) is not None

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def text(self, name: str, default: str) -> str:
        """Return the text; `default` where it is absent or empty."""
        value = self._values.get(name)
        if value is not None and not isinstance(value, str):
            raise self.wrong(name, "text")
        return value or default

    def texts(self, name: str) -> list[str]:
        values = self._list(name)
        if not all(isinstance(value, str) for value in values):
            raise self.wrong(name, "a list of texts")
        return values

    def flag(self, name: str, default: bool) -> bool:
        value = self._values.get(name)
        if value is not None and not isinstance(value, bool):
            raise self.wrong(name, "true or false")
        return default if value is None else value

    def number(self, name: str, default: float) -> float:
        value = self._values.get(name, default)
        if value is None:
            return float(default)
        if not _is_number(value):
            raise self.wrong(name, "a number")
        return float(value)

    def numbers(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return as many numbers as `default` has."""
        values = self._list(name)
        if not values:
            return tuple(map(float, default))
        if len(values) != len(default) or not all(_is_number(value) for value in values):
            raise self.wrong(name, f"{len(default)} numbers")
        return tuple(map(float, values))

    def whole(self, name: str, default: int | None = None) -> int:
        """Return the whole number from 0; InputError if it is absent and has no `default`."""
        value = self._values.get(name)
        if value is None and default is not None:
            return default
        if value is None or not _is_whole(value):
            raise self.wrong(name, "a whole number from 0")
        return int(value)

    def wholes(self, name: str) -> list[int]:
        """Return the whole numbers from 0, none where they are absent."""
        values = self._list(name)
        if not all(_is_whole(value) for value in values):
            raise self.wrong(name, "a list of whole numbers from 0")
        return [int(value) for value in values]

    def wholes_by_name(self, name: str) -> dict[str, int]:
        """Return the object `name`, whose values are all whole numbers from 0, as indices by attributes are."""
        found = self.object(name)
        return {key: found.whole(key) for key in found}

    def object(self, name: str) -> "JsonObject":
        """Return the object, one without values where it is absent."""
        value = {} if self._values.get(name) is None else self._values[name]
        if not isinstance(value, dict):
            raise self.wrong(name, "an object")
        return JsonObject(self.file, self._place(name), value)

    def objects(self, name: str, limit: int) -> list["JsonObject"]:
        """Return the list of at most `limit` objects, an empty one where it is absent."""
        values = self._list(name)
        if len(values) > limit:
            found = f"has {len(values)} {self._place(name)}, more than {limit}"
            raise InputError(found, where=self.file, do="join some, or split the model")
        if not all(isinstance(value, dict) for value in values):
            raise self.wrong(name, "a list of objects")
        return [JsonObject(self.file, f"{self._place(name)}[{i}]", value) for i, value in enumerate(values)]

    def wrong(self, name: str, wanted: str) -> InputError:
        """Return the error that the value `name` is not of the `wanted` form."""
        shown = json.dumps(self._values[name])[:SHOWN] if name in self else "absent"
        return self.damaged(f"{self._place(name)} is {shown}, expected {wanted}")

    def damaged(self, found: str) -> InputError:
        """Return the error that the file is damaged, with the reason `found`."""
        return InputError(found, where=self.file, do=MEND)

    def _place(self, name: str) -> str:
        return f"{self.place}.{name}" if self.place else name

    def _list(self, name: str) -> list[Any]:
        value = self._values.get(name)
        if value is not None and not isinstance(value, list):
            raise self.wrong(name, "a list")
        return value or []


def parsed_object(data: bytes, file: Path) -> JsonObject:
    """Return the JSON object in `data`, which is of that file. Raises InputError."""
    try:
        found = parsed_json(data)
    except ValueError as error:
        raise InputError(f"is damaged: its JSON cannot be read ({error})", where=file, do=MEND) from None
    if not isinstance(found, dict):
        raise InputError("is damaged: its JSON is not an object", where=file, do=MEND)
    return JsonObject(file, "", found)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_number(value: Any) -> bool:
    """Return whether it is a number that a double holds."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return isfinite(value)
    except OverflowError:
        return False

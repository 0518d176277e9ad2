"""The meaning of a file's channels, or of a table's columns, which travels with the file."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Channels:
    """The numbers of an image file, whose channels share a type, or of a table, whose columns have their own."""

    meaning: str
    """Phrase that describes all."""
    dtype: str | Mapping[str, str]
    """The numbers' type, as numpy names it; of a table each column's, by its name."""
    holds: Mapping[str, str]
    """Content of each channel or column, by its name in the file, in order."""
    unit: str = ""
    """Unit of the numbers; "" for none."""
    frame: str = ""
    """The axes of coordinates, "cam", "body" or "lidar"; "" for none."""
    encoding: str = ""
    """The transfer curve of light to the numbers, as Sensor has it; "" for a label."""
    gamma: float | None = None
    """Exponent of the encoding "gamma"."""

    @property
    def names(self) -> tuple[str, ...]:
        """The channels' names in the file."""
        return tuple(self.holds)

    @property
    def described(self) -> dict[str, Any]:
        """The JSON of a record; entries without a value are not in it."""
        rest = {"unit": self.unit, "frame": self.frame, "encoding": self.encoding, "gamma": self.gamma}
        dtype = self.dtype if isinstance(self.dtype, str) else dict(self.dtype)
        return {"dtype": dtype, "channels": dict(self.holds), **{name: it for name, it in rest.items() if it}}

    def header(self, kind: str) -> dict[str, str]:
        """Return the same as attributes of the header of a file of that `kind`."""
        whole = {"kind": kind, "unit": self.unit, "frame": self.frame, "encoding": self.encoding}
        each = {f"spin:channel:{name}": it for name, it in self.holds.items()}
        return {"ImageDescription": self.meaning} | {f"spin:{name}": it for name, it in whole.items() if it} | each

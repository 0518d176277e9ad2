"""Operational domains: the range of each dimension in which a network shall work, in cells that data must cover."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.formats.checked_document import read_as
from spin_usd.formats.text_file import read_toml_file
from spin_usd.geometry.sphere_cells import SphereCells

OUTSIDE, UNKNOWN = -1, -2  # instead of a cell
BACKGROUNDS = ("space", "planet", "picture")
MAX_CELLS = 100_000
Places: TypeAlias = NDArray[np.intp]
Bounds: TypeAlias = dict[str, list[float] | str]


class DomainTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of a domain's file."""


class NumberCells(DomainTable, frozen=True, kw_only=True):
    """Numbers, in bins between `edges`, or in `bins` from `low` to `high`; a bin has its lower edge, the last both."""

    edges: tuple[float, ...] = ()
    low: float | None = None
    high: float | None = None
    bins: Annotated[int, Meta(ge=1, le=MAX_CELLS)] = 1
    spacing: Literal["linear", "log"] = "linear"

    def __post_init__(self) -> None:
        if bool(self.edges) == (self.low is not None or self.high is not None):
            raise InputError("has neither or both of edges and limits", do="give edges, or low and high")
        if not self.edges and (self.low is None or self.high is None):
            raise InputError("has only one of low and high", do="give both")
        if self.spacing == "log" and not (self.low or 0) > 0:
            raise InputError("has no low above 0, as spacing log needs", do="give low and high above 0")
        found = self.limits
        if len(found) < 2 or not (np.isfinite(found).all() and (np.diff(found) > 0).all()):
            raise InputError(f"has the edges {[*found]}, which do not ascend", do="give ascending numbers")

    @property
    def limits(self) -> tuple[float, ...]:
        """The edges of all bins."""
        if self.edges or self.low is None or self.high is None:
            return self.edges
        space = np.geomspace if self.spacing == "log" else np.linspace
        return tuple(space(self.low, self.high, self.bins + 1).tolist())

    @property
    def count(self) -> int:
        return len(self.limits) - 1

    def places(self, values: Sequence[Any]) -> Places:
        """Return (N,) the bin of each value, OUTSIDE or UNKNOWN."""
        numbers, edges = np.array(values, np.float64), np.array(self.limits)
        found = np.searchsorted(edges, numbers, side="right") - 1
        found[numbers == edges[-1]] = self.count - 1
        return np.where(np.isnan(numbers), UNKNOWN, np.where((found < 0) | (found >= self.count), OUTSIDE, found))

    def bounds(self, name: str, place: int) -> Bounds:
        """Return the limits of a bin."""
        return {name: list(self.limits[place : place + 2])}


class DirectionCells(DomainTable, frozen=True, kw_only=True):
    """Directions from the target to the camera, body axes, in `cells` of equal area."""

    cells: Annotated[int, Meta(ge=1, le=MAX_CELLS)]

    @property
    def count(self) -> int:
        return self.cells

    def places(self, values: Sequence[Any]) -> Places:
        """Return (N,) the cell of each direction, UNKNOWN for None."""
        known = np.array([value is not None for value in values], bool)
        found = np.full(len(values), UNKNOWN, np.intp)
        directions = np.array([value for value in values if value is not None], np.float64).reshape(-1, 3)
        found[known] = SphereCells(count=self.cells).places(directions)
        return found

    def bounds(self, name: str, place: int) -> Bounds:
        """Return the latitudes and longitudes of a cell, degrees: z is the body's north, x its longitude 0."""
        latitudes, longitudes = SphereCells(count=self.cells).bounds(place)
        return {"latitude_deg": list(latitudes), "longitude_deg": list(longitudes)}


class NameCells(DomainTable, frozen=True, kw_only=True):
    """Names, one cell each."""

    values: Annotated[tuple[str, ...], Meta(min_length=1)]

    def __post_init__(self) -> None:
        if unknown := next((value for value in self.values if value not in BACKGROUNDS), None):
            raise InputError(f"has no value {unknown!r}", do=suggestion(unknown, BACKGROUNDS))
        if len(set(self.values)) < len(self.values):
            raise InputError("names a value twice", do="name each once")

    @property
    def count(self) -> int:
        return len(self.values)

    def places(self, values: Sequence[Any]) -> Places:
        """Return (N,) the cell of each name, OUTSIDE or UNKNOWN."""
        known = {value: place for place, value in enumerate(self.values)}
        return np.array([UNKNOWN if each is None else known.get(each, OUTSIDE) for each in values], np.intp)

    def bounds(self, name: str, place: int) -> Bounds:
        """Return the name of a cell."""
        return {name: self.values[place]}


Cells: TypeAlias = NumberCells | DirectionCells | NameCells
UNITS = {
    "range": "m",
    "sun": "deg",
    "attitude": "",
    "roll": "deg",
    "visible": "",
    "signal_to_noise": "",
    "background": "",
    "size": "px",
    "blur": "px",
}
"""Unit of each dimension of a domain, "" for none."""
HIGHEST = {"sun": 180.0, "roll": 360.0, "visible": 1.0}
"""Highest number that a dimension can have; the lowest is 0 for all."""


class Domain(DomainTable, frozen=True, kw_only=True):
    """A domain. Only the dimensions that it names need to be covered."""

    schema: Literal["domain-1"]
    title: str = ""
    pictures: Annotated[int, Meta(ge=1)] = 1
    """Least number of pictures in each cell."""
    pairs: tuple[tuple[str, str], ...] = ()
    """Dimensions that are covered together."""
    range: NumberCells | None = None
    sun: NumberCells | None = None
    attitude: DirectionCells | None = None
    roll: NumberCells | None = None
    visible: NumberCells | None = None
    signal_to_noise: NumberCells | None = None
    background: NameCells | None = None
    size: NumberCells | None = None
    blur: NumberCells | None = None

    def __post_init__(self) -> None:
        if not self.dimensions:
            raise InputError("names no dimension", do=f"add a table such as [range]; there are {', '.join(UNITS)}")
        for name, cells in self.dimensions.items():
            if isinstance(cells, NumberCells) and not 0 <= cells.limits[0] < cells.limits[-1] <= HIGHEST.get(
                name, np.inf
            ):
                most = f" to {HIGHEST[name]:g}" if name in HIGHEST else " or more"
                raise InputError(f"{name} has edges that it cannot reach", do=f"give numbers from 0{most}")
        for pair in self.pairs:
            if other := next((name for name in pair if name not in self.dimensions), None):
                raise InputError(f"pairs a dimension {other!r} that it does not name", do=f"add a table [{other}]")
            if pair[0] == pair[1]:
                raise InputError(f"pairs {pair[0]} with itself", do="pair two dimensions")
            if np.prod([self.dimensions[name].count for name in pair]) > MAX_CELLS:
                raise InputError(f"{' and '.join(pair)} have more than {MAX_CELLS} cells", do="give fewer bins")

    @property
    def dimensions(self) -> Mapping[str, Cells]:
        """The cells of each dimension that is named."""
        return {name: cells for name in UNITS if (cells := getattr(self, name)) is not None}

    @property
    def covered(self) -> tuple[tuple[str, ...], ...]:
        """The dimensions that are covered, each alone and in pairs."""
        return (*((name,) for name in self.dimensions), *self.pairs)


def read_domain(path: Path) -> Domain:
    """Read the domain in the TOML file at `path`. Raises InputError that names the key that is wrong."""
    tables = read_toml_file(path, MAX_SPECIFICATION)
    known = Domain.__struct_fields__
    if unknown := next((name for name in tables if name not in known), None):
        raise InputError(f"there is no dimension {unknown!r}", where=path, do=suggestion(unknown, known))
    return read_as(Domain, tables, path)

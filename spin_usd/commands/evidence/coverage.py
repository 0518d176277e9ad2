"""Coverage of a domain by pictures: the share of cells with enough of them, and the holes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from spin_usd.commands.evidence.domain import OUTSIDE, UNKNOWN, Bounds, Domain, Places
from spin_usd.commands.evidence.report import CellCoverage, Hole


@dataclass(frozen=True)
class Covered:
    """Pictures in the cells of a domain."""

    domain: Domain
    columns: Mapping[str, Sequence[Any]]
    """(N,) the values of the pictures by the fields of PictureRow, whatever they come from."""

    @property
    def names(self) -> list[str]:
        """(N,) VARIANT/FRAME of each picture."""
        return [
            f"{variant}/{name}" for variant, name in zip(self.columns["variant"], self.columns["name"], strict=True)
        ]

    @cached_property
    def places(self) -> dict[str, Places]:
        """(N,) the cell of each picture in each dimension, OUTSIDE or UNKNOWN."""
        return {name: cells.places(self.columns[name]) for name, cells in self.domain.dimensions.items()}

    @cached_property
    def coverage(self) -> list[CellCoverage]:
        """The coverage of each dimension and pair."""
        return [_coverage(self.domain, names, [self.places[name] for name in names]) for names in self.domain.covered]

    @property
    def outside(self) -> dict[str, list[str]]:
        """The pictures that lie outside the domain, with the dimensions in which they do."""
        beyond = {name: found == OUTSIDE for name, found in self.places.items()}
        listed = {picture: [name for name, out in beyond.items() if out[row]] for row, picture in enumerate(self.names)}
        return {picture: names for picture, names in listed.items() if names}


def _coverage(domain: Domain, names: Sequence[str], found: Sequence[Places]) -> CellCoverage:
    shape = tuple(domain.dimensions[name].count for name in names)
    inside = np.all([each >= 0 for each in found], axis=0)
    numbers = np.ravel_multi_index(tuple(each[inside] for each in found), shape)
    counts = np.bincount(numbers, minlength=int(np.prod(shape)))
    few = np.flatnonzero(counts < domain.pictures)
    worst = few[np.argsort(counts[few], kind="stable")]
    return CellCoverage(
        dimensions=list(names),
        cells=len(counts),
        covered=len(counts) - len(few),
        share=1 - len(few) / len(counts),
        counts=counts.tolist(),
        unknown=int(np.any([each == UNKNOWN for each in found], axis=0).sum()),
        holes=[_hole(domain, names, np.unravel_index(cell, shape), int(counts[cell])) for cell in worst],
    )


def _hole(domain: Domain, names: Sequence[str], place: Sequence[Any], pictures: int) -> Hole:
    cells = {name: int(at) for name, at in zip(names, place, strict=True)}
    bounds: Bounds = {}
    for name, at in cells.items():
        bounds |= domain.dimensions[name].bounds(name, at)
    return Hole(cells=cells, bounds=bounds, pictures=pictures)

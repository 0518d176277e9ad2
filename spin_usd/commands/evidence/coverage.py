"""Coverage of a domain by pictures: the share of cells with enough of them, and the holes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from spin_usd.commands.evidence.domain import OUTSIDE, UNKNOWN, Bounds, Domain, Places
from spin_usd.commands.evidence.report import CellCoverage, Hole


def places_of(domain: Domain, columns: Mapping[str, Sequence[Any]]) -> dict[str, Places]:
    """Return (N,) the cell of each picture in each dimension, OUTSIDE or UNKNOWN."""
    return {name: cells.places(columns[name]) for name, cells in domain.dimensions.items()}


def coverage_of(domain: Domain, places: Mapping[str, Places]) -> list[CellCoverage]:
    """Return the coverage of each dimension and pair by pictures at these places."""
    return [_coverage(domain, names, [places[name] for name in names]) for names in domain.covered]


def outside(places: Mapping[str, Places], pictures: Sequence[str]) -> dict[str, list[str]]:
    """Return the pictures that lie outside the domain, with the dimensions in which they do."""
    beyond = {name: found == OUTSIDE for name, found in places.items()}
    listed = {picture: [name for name, out in beyond.items() if out[row]] for row, picture in enumerate(pictures)}
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

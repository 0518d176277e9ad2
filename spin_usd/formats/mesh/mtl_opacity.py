"""Opacity from MTL's `d` and `Tr`, of which only `d` stands in the format's own text.

To most programs Tr is 1 - d, to others another name of d: MeshLab, openMVS and mvs-texturing wrote `Tr 1` and no d of
opaque materials for years (MeshLab issue 1399, openMVS pull request 1285, mvs-texturing pull request 97), IfcOpenShell
both with one value (its issue 140). So d decides where it stands. Where only Tr does, a library has one writer: if it
says `Tr 1` of a material and `Tr 0` of none, 1 is opaque to it, because nobody exports what cannot be seen.
"""

from collections.abc import Collection
from dataclasses import dataclass

AGREEMENT = 0.01  # exporters round d and Tr apart


@dataclass(frozen=True, kw_only=True)
class Statements:
    """The statements of one material on its opacity, None where it has none."""

    d: float | None = None
    tr: float | None = None


def tr_is_opacity(library: Collection[Statements]) -> bool:
    """Return whether the writer of a library gives Tr the meaning of d: see the head of this file."""
    alone = {said.tr for said in library if said.d is None and said.tr is not None}
    return 1.0 in alone and 0.0 not in alone


def opacity(said: Statements, tr_is_d: bool) -> float:
    """0 to 1: the share of the surface that is there; 1 where nothing is said."""
    if said.d is not None:
        return said.d
    if said.tr is None:
        return 1.0
    return said.tr if tr_is_d else 1 - said.tr


def opacity_note(said: Statements, tr_is_d: bool) -> str | None:
    """Return a note for the user on a material whose opacity was decided by this file's rule."""
    if said.tr is None:
        return None
    if said.d is not None:
        agrees = abs(said.d - (1 - said.tr)) <= AGREEMENT
        return None if agrees else f"d {said.d:g} and Tr {said.tr:g} contradict each other: d was taken"
    if tr_is_d:
        return (
            f"Tr {said.tr:g} without d was taken as opacity {said.tr:g}, because its library says Tr 1 and nowhere "
            "Tr 0, as MeshLab does of opaque materials; write d to say otherwise"
        )
    return (
        f"Tr {said.tr:g} without d was taken as opacity {1 - said.tr:g}; write d to say otherwise" if said.tr else None
    )

"""Pieces of an ephemeris: the segments of a file, each with its span and the values within it."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.formats.ccsds_file import EphemerisSegment
from spin_usd.orbits.orbit_context import OrbitContext

MARGIN_S = 1.0  # by which a file is extrapolated beyond its span
At = Callable[[Float], Float]
"""Gives something at seconds (N,)."""
Piece = tuple[tuple[float, float], At]
"""First and last second of a part of a file, and its values."""


def ordered(times: Float, path: Path) -> Float:
    """Return the times of a file, two or more and increasing. Raises InputError."""
    if len(times) < 2:
        raise InputError(f"has {len(times) or 'no'} state{'s' * (not len(times))}", where=path, do="give two or more")
    if len(back := np.flatnonzero(np.diff(times) <= 0)):
        i = int(back[0]) + 1
        found = f"goes back by {times[i - 1] - times[i]:g} s at state {i + 1}"
        raise InputError(found, where=path, do="sort the states by time")
    return times


def useable_span(times: Float, segment: EphemerisSegment, context: OrbitContext, path: Path) -> tuple[float, float]:
    """Return the first and last second of a segment's states that its file declares useable. Raises InputError."""
    first, last = (
        float(context.epochs.seconds_of([text], segment.time_system, path)[0]) if text else end
        for text, end in zip(segment.useable, (-np.inf, np.inf), strict=True)
    )
    return max(float(times[0]), first), min(float(times[-1]), last)


def pieced(
    pieces: Sequence[Piece], context: OrbitContext, path: Path, *, close: tuple[float, str] = (np.inf, "")
) -> Float:
    """Return the values of a file's pieces at the epochs (N,). A piece is beyond its span where no other has values.
    `close`: difference between two pieces, with its unit, beyond which a note tells that the later one is used. Raises
    InputError for epochs outside all pieces."""
    seconds, found = context.epochs.seconds, None
    said = np.zeros(len(seconds), bool)
    parts = [(span, at, margin) for margin in (0.0, MARGIN_S) for span, at in pieces]
    for (first, last), at, margin in parts:
        chosen = (seconds >= first - margin) & (seconds <= last + margin) & ~(said & (margin > 0))
        if not chosen.any():
            continue
        values = at(seconds[chosen])
        found = np.empty((len(seconds), *values.shape[1:])) if found is None else found
        twice = said[chosen]
        if twice.any() and np.abs(values - found[chosen])[twice][:, :3].max() > close[0]:
            differ = f"differ by more than {close[0]:g} {close[1]}; the later one is used"
            context.notes[f"{path.name} has segments that overlap and {differ}"] = None
        found[chosen], said = values, said | chosen
    if found is None or not said.all():
        second = float(seconds[np.argmin(said)])
        raise InputError(f"has no state at second {second:g}", where=path, do="choose times within its useable span")
    return found

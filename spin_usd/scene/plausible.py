"""Plausible sizes of a spacecraft, and the likely unit of a model that has another size."""

from collections.abc import Callable, Sequence

from spin_usd.basics.arrays import Float

SIZES = (
    0.02,
    200.0,
)  # metres, of the longest edge of its box: a chip satellite's, and nearly twice the largest station's
UNITS = ((1.0, 100.0, 1000.0), (10.0, 39.37007874, 3.280839895))
"""Units in a metre; one of them is likely: metres, centimetres, millimetres; else decimetres, inches, feet."""


def is_plausible(size: Sequence[float] | Float) -> bool:
    """Return whether a bounding box of `size` (3,), metres, is neither too large nor too small for a spacecraft."""
    return bool(SIZES[0] <= max(size) <= SIZES[1])


def likely_units(size: Float, units: float, fits: Callable[[float], bool]) -> list[float]:
    """Return the units in a metre at which a model, of `size` (3,), metres, at `units` of them, is a plausible craft
    that `fits` the pictures when it is so many times as large: the usual ones first, and of these the largest craft,
    which fills most of the frame."""
    others = [other for group in UNITS for other in sorted(group) if other != units]
    return [other for other in others if is_plausible(size * units / other) and fits(units / other)]

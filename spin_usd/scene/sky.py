"""Places of Sun, target and planet in a stage's pictures, in camera axes."""

from dataclasses import dataclass

from spin_usd.arrays import Float


@dataclass(frozen=True, kw_only=True, eq=False)
class Sky:
    """Places of Sun, target and planet in the pictures; arrays have one row for each picture, or one for all.

    sun: unit directions to it · target: its middle, metres, in a ball of `target_radius` · planet: its centre, metres ·
    radii: its least and greatest semi-axis · frame: unit directions (M, 3) through the rim of the picture.
    """

    sun: Float | None
    target: Float
    target_radius: float
    planet: Float | None
    radii: tuple[float, float]
    frame: Float

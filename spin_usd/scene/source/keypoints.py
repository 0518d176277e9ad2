"""Named points of a target."""

from dataclasses import dataclass

from spin_usd.arrays import Float


@dataclass(frozen=True, kw_only=True, eq=False)
class Keypoints:
    """names (K,), each once · points (K, 3): body axes, metres, double precision."""

    names: tuple[str, ...]
    points: Float

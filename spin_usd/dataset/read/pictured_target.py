"""A target in one picture of a dataset, as its record has it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from spin_usd.arrays import Float, frozen
from spin_usd.geometry.transform import Transform


@dataclass(frozen=True, kw_only=True, eq=False)
class PicturedTarget:
    """One of the targets of a picture; arrays are read-only.

    id: its number in the label `instance`, from 1 · T_cam_body (4, 4), q_cam_body (4,) and t_cam_body (3,) float64: its
    pose, as a Picture has that of the first target · range: from the camera to the origin of its axes, metres.
    """

    id: int
    name: str
    T_cam_body: Float
    q_cam_body: Float
    t_cam_body: Float
    range: float

    @classmethod
    def of(cls, found: Mapping[str, Any]) -> Self:
        """Make it of a record's entry."""
        q, t = found["pose"]["q_cam_body"], found["pose"]["t_cam_body"]
        return cls(
            id=found["id"],
            name=found["name"],
            T_cam_body=frozen(Transform.from_quaternion(to="cam", of="body", q=q, t=t).matrix),
            q_cam_body=frozen(q),
            t_cam_body=frozen(t),
            range=found["range"],
        )

"""What a stand-in is made of: parts of boxes or round solids, each of one material. Metres, body axes."""

from dataclasses import dataclass, field
from typing import TypeAlias

Point: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Box:
    """From one corner to the opposite one."""

    low: Point
    high: Point


@dataclass(frozen=True, kw_only=True)
class Round:
    """A Cylinder, Cone or Sphere of USD about `centre`; `turn`: degrees about x, y and z, from an axis along z."""

    kind: str
    centre: Point
    radius: float
    height: float = 0.0
    turn: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Part:
    """kind: the class of its label."""

    name: str
    kind: str
    material: str
    solids: tuple[Box, ...] | Round


@dataclass(frozen=True, kw_only=True)
class Craft:
    """keypoints: name -> place. Its file is named `name`, its prim `prim`."""

    name: str
    prim: str
    about: str
    parts: tuple[Part, ...]
    keypoints: dict[str, Point] = field(default_factory=dict)


def block(centre: Point, size: Point) -> Box:
    (x, y, z), (dx, dy, dz) = centre, size
    return Box(low=(x - dx / 2, y - dy / 2, z - dz / 2), high=(x + dx / 2, y + dy / 2, z + dz / 2))


def corners(box: Box, name: str) -> dict[str, Point]:
    """Its eight corners, as keypoints."""
    both = (box.low, box.high)
    every = [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    return {f"{name}_{n}": (both[i][0], both[j][1], both[k][2]) for n, (i, j, k) in enumerate(every, 1)}

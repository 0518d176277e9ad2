"""What a stand-in is made of: parts of boxes or round solids, each of one material. Metres, body axes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from spin_usd.craft.solids import Solid

Point: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Round:
    """A Cylinder, Cone or Sphere of USD about `centre`; `turn`: degrees about x, y and z, from an axis along z."""

    kind: str
    material: str
    centre: Point
    radius: float
    height: float = 0.0
    turn: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Part:
    """kind: the class of its label."""

    name: str
    kind: str
    solids: tuple[Solid, ...] | Round

    @property
    def material(self) -> str:
        return self.solids.material if isinstance(self.solids, Round) else self.solids[0].materials[0]


@dataclass(frozen=True, kw_only=True)
class Craft:
    """keypoints: name -> place. Its file is named `name`, its prim `prim`."""

    name: str
    prim: str
    about: str
    parts: tuple[Part, ...]
    keypoints: Mapping[str, Sequence[float]] = field(default_factory=dict)

"""What a craft from a seed is made of: parts of closed solids with classes, keypoints and joints. Metres, body axes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.craft.solids import DECIMALS, Solid

KINDS: Mapping[str, str] = {
    "bus": "main_body",
    "truss": "main_body",
    "radiator": "main_body",
    "handle": "main_body",
    "cable": "main_body",
    "wing": "solar_panel",
    "body_array": "solar_panel",
    "dish": "dish_antenna",
    "horn": "dish_antenna",
    "omni": "omni_antenna",
    "barrel": "payload",
    "star_tracker": "payload",
    "main_engine": "thruster",
    "thruster": "thruster",
    "adapter_ring": "adapter_ring",
}
"""Kinds of parts, and the classes that SpaceSense-Bench (arXiv 2603.09320) has for them: horns are directional antennas
as dishes are, star trackers look as cameras do."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FieldOfView:
    """The field of view of a part: no other part may be in it."""

    apex: Float
    """(3,)"""
    axis: Float
    """(3,) unit vector."""
    half_angle_deg: float

    def sees(self, triangles: Float) -> bool:
        """Return whether one of the triangles (N, 3, 3) reaches into it: with a corner, with the point of an edge that
        is nearest to the axis in angle, or with its inside around the axis."""
        starts = triangles - self.apex
        ends = np.roll(starts, -1, axis=1)
        edges, ahead = ends - starts, starts @ self.axis
        square, along, length = (np.sum(a * b, axis=-1) for a, b in ((starts, starts), (starts, edges), (edges, edges)))
        more = edges @ self.axis
        above, below = ahead * along - more * square, more * along - ahead * length
        share = np.divide(above, below, out=np.zeros_like(above), where=below != 0).clip(0, 1)
        points = np.concatenate([starts, starts + share[..., None] * edges], axis=1)
        cosine = np.cos(np.radians(self.half_angle_deg))
        if np.any(points @ self.axis > cosine * np.maximum(np.linalg.norm(points, axis=-1), 1e-9)):
            return True
        sides = np.cross(starts, ends) @ self.axis
        around = (sides >= 0).all(axis=1) | (sides <= 0).all(axis=1)
        normals = np.cross(edges[:, 0], edges[:, 1])
        before = np.sum(normals * starts[:, 0], axis=1) * (normals @ self.axis) > 0
        return bool(np.any(around & before))


@dataclass(frozen=True, kw_only=True, eq=False)
class Joint:
    """The hinge by which a part is driven: it turns freely about an axis of the body."""

    axis: str
    """X, Y or Z."""
    at: Float
    """(3,) a point on it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CraftPart:
    """A part: solids that are one piece, and never share a plane with another part's."""

    name: str
    kind: str
    """One of KINDS."""
    solids: tuple[Solid, ...]
    keypoints: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Points (3,) by names that are unique in the part."""
    view: FieldOfView | None = None
    joint: Joint | None = None

    @cached_property
    def points(self) -> Float:
        """(P, 3) points of all its solids, rounded."""
        found: Float = np.round(np.concatenate([each.points for each in self.solids]), DECIMALS) + 0.0
        return found

    @cached_property
    def triangles(self) -> Float:
        """(T, 3, 3) corners of the triangles that its faces are fans of."""
        fans = (solid.points[[face[0], face[i], face[i + 1]]] for solid in self.solids for face, i in solid.fans)
        return np.stack(list(fans))

    @cached_property
    def bounds(self) -> tuple[Float, Float]:
        """The lowest and the highest corner of its box."""
        return self.points.min(axis=0), self.points.max(axis=0)


@dataclass(frozen=True, kw_only=True, eq=False)
class GeneratedCraft:
    """A whole craft."""

    name: str
    family: str
    parts: tuple[CraftPart, ...]
    symmetries: tuple[Float, ...] = ()
    """Rotations (3, 3), but the identity, that leave its shape and its materials as they are."""

    @cached_property
    def keypoints(self) -> Mapping[str, Float]:
        """Points (3,) by name: the part's name, and the point's own."""
        return {
            f"{part.name}_{name}": np.round(np.asarray(place, float), DECIMALS) + 0.0
            for part in self.parts
            for name, place in part.keypoints.items()
        }


def corners_of(solid: Solid) -> dict[str, Sequence[float]]:
    """Return the corners of a box as keypoints."""
    return {f"corner_{number}": point.tolist() for number, point in enumerate(solid.points, 1)}


def keeps(parts: Sequence[CraftPart], rotation: Float, tolerance: float = 2e-6) -> bool:
    """Return whether a rotation about the origin brings each part onto one of the same solids and materials."""
    return all(any(_onto(part, other, rotation, tolerance) for other in parts) for part in parts)


def _onto(part: CraftPart, other: CraftPart, rotation: Float, tolerance: float) -> bool:
    if part.kind != other.kind or part.points.shape != other.points.shape:
        return False
    if [s.materials for s in part.solids] != [s.materials for s in other.solids]:
        return False
    turned, there = part.points @ rotation.T, other.points
    if not np.allclose([turned.min(0), turned.max(0)], other.bounds, atol=tolerance):
        return False
    nearest = np.abs(turned[:, None] - there[None]).max(axis=2).min(axis=1)
    return bool(nearest.max() <= tolerance)

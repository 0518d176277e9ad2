"""The spacecraft: its mesh, parts, materials and keypoints."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, digest, finite
from spin_usd.errors import GeometryError
from spin_usd.scene.content import content
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh

MAX_PARTS = 2**16 - 1  # part ids are 16-bit in the segmentation label


@dataclass(frozen=True, kw_only=True)
class Part:
    """A piece of the target that the segmentation label distinguishes. `id` counts from 1 in order of prim path."""

    id: int
    path: str
    name: str
    class_name: str


@dataclass(frozen=True, kw_only=True, eq=False)
class ChangedPart:
    """A part that is not as the model has it."""

    path: str
    name: str
    T_body_drawn: Float
    """(4, 4) from its place in the model to its place here, body axes, metres: a rotation, a scale and a shift."""
    bend_deg: float = 0.0
    bulge: float = 0.0
    """Height in metres."""
    missing: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class TargetShape:
    """How a target's shape differs from its model's."""

    parts: tuple[ChangedPart, ...]
    drawn_keypoints: Float
    """(K, 3) keypoints of the model, body axes, metres."""
    keypoint_parts: tuple[str, ...]
    """Path of the part that each keypoint belongs to; "" for none."""
    keypoint_missing: NDArray[np.bool_]
    """(K,) True for keypoints of missing parts."""

    @property
    def key(self) -> str:
        """Digest of all that the record has of it."""
        parts = [[p.path, p.name, digest(p.T_body_drawn), p.bend_deg, p.bulge, p.missing] for p in self.parts]
        return digest(parts, self.drawn_keypoints, self.keypoint_parts, self.keypoint_missing.tolist())


@dataclass(frozen=True, kw_only=True, eq=False)
class Target:
    """The spacecraft: mesh, parts, materials, named keypoints (K, 3) in body axes, metres."""

    path: str
    name: str
    mesh: Mesh
    parts: tuple[Part, ...]
    materials: tuple[Material, ...]
    keypoint_names: tuple[str, ...] = ()
    keypoints: Float = field(default_factory=lambda: np.zeros((0, 3)))
    shape: TargetShape | None = None
    """None if it is as its model has it."""

    def __post_init__(self) -> None:
        if [p.id for p in self.parts] != list(range(1, len(self.parts) + 1)) or len(self.parts) > MAX_PARTS:
            raise GeometryError(f"{self.path} has parts that are not numbered 1 to at most {MAX_PARTS}")
        if self.mesh.part_ids[0] < 1 or self.mesh.part_ids[1] > len(self.parts):
            raise GeometryError(f"{self.path} has faces of a part that it does not list")
        used = [int(limit) for s in self.mesh.shapes for limit in (s.face_material.min(), s.face_material.max())]
        if not 0 <= min(used) <= max(used) < len(self.materials):
            raise GeometryError(f"{self.path} has faces of a material that it does not list")
        object.__setattr__(self, "keypoints", finite(self.keypoints, (len(self.keypoint_names), 3), "keypoints"))

    @cached_property
    def coloured(self) -> bool:
        """True where a picture in colour may show more than one in grey."""
        colours = [material.diffuse_color for material in self.materials]
        return any(len(set(colour)) > 1 if isinstance(colour, tuple) else True for colour in colours)

    @property
    def drawn_keypoints(self) -> Float:
        """(K, 3) keypoints of the model, body axes, metres."""
        return self.shape.drawn_keypoints if self.shape else self.keypoints

    @property
    def part_materials(self) -> Mapping[int, tuple[str, ...]]:
        """The names of the materials of each part that has any, by its id; a displayColor has no name."""
        pairs = _pairs(self.mesh.face_part, self.mesh.face_material)
        for each in self.mesh.instances:
            for column, material in _pairs(each.shape.face_part, each.shape.face_material):
                pairs |= {(int(part), material) for part in each.parts[:, column]}
        found: dict[int, tuple[str, ...]] = {}
        for part, material in sorted(pairs):
            if name := self.materials[material].name:
                found[part] = (*found.get(part, ()), name)
        return found

    @cached_property
    def key(self) -> str:
        """Digest of all that labels and pictures of the target depend on."""
        rest = [self.parts, self.materials, self.keypoint_names, self.keypoints]
        changed = [self.shape.key] if self.shape else []
        return digest(self.mesh.key, self.mesh.shading_key, content(rest), *changed)

    @cached_property
    def cut_out_key(self) -> str:
        """Digest of the inputs of cut-outs: "" without holes."""
        if not any(material.cut_out for material in self.materials):
            return ""
        cuts = [[m.opacity, m.opacity_threshold] if m.cut_out else None for m in self.materials]
        return digest(content(cuts), self.mesh.shading_key)


def _pairs(*columns: NDArray[Any]) -> set[tuple[int, int]]:
    """Return each pair that stands in the two columns (F,) side by side."""
    return {(first, second) for first, second in np.unique(np.stack(columns, 1), axis=0).tolist()}

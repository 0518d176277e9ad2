"""Properties of the materials on a target's faces: whether all reflect diffusely, some let rays through, or shine.

A texture or primvar that is the same on all faces counts as the number that it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.scene.derived.lookup import extremes
from spin_usd.scene.material import PRESENCE, Material
from spin_usd.scene.shape import Shape
from spin_usd.scene.target import Target
from spin_usd.scene.texture import Colored, Primvar, Scalar, Texture

Faces = Sequence[tuple[Shape, NDArray[np.bool_]]]
"""Shapes, with their faces (F,) that show a material: some of each shape."""


@dataclass(frozen=True, kw_only=True)
class ShownMaterials:
    """Optical properties of the materials of all bodies."""

    diffuse: bool
    """Whether all reflects by Lambert's law and nothing else."""
    transparent: bool
    """Whether rays may go on through some."""
    emissive: bool
    """Whether some shines."""


@lru_cache(maxsize=16)
def shown_materials(target: Target) -> ShownMaterials:
    """Return the properties of the materials on `target`, found once for all of its pictures."""
    shown = [(material, _faces(target, index)) for index, material in enumerate(target.materials)]
    seen = [(material, faces) for material, faces in shown if faces]
    return ShownMaterials(
        diffuse=all(_is_diffuse(material, faces) for material, faces in seen),
        transparent=not all(_is_opaque(material, faces) for material, faces in seen),
        emissive=not all(_is_always(material.emissive_color, 0.0, faces) for material, faces in seen),
    )


def _faces(target: Target, index: int) -> Faces:
    """Return the faces that show the material `index`."""
    found = ((shape, np.asarray(shape.face_material == index)) for shape in target.mesh.shapes)
    return [(shape, faces) for shape, faces in found if faces.any()]


def _is_opaque(material: Material, faces: Faces) -> bool:
    if material.cut_out:
        return bool(_range(material.opacity, faces)[0].min() >= material.opacity_threshold)
    return _is_always(material.opacity, 1.0, faces)


def _is_diffuse(material: Material, faces: Faces) -> bool:
    solid = material.cut_out or material.opacity_mode == PRESENCE or _is_always(material.opacity, 1.0, faces)
    if not solid or not _is_always(material.clearcoat, 0.0, faces):
        return False
    if material.use_specular_workflow:
        return _is_always(material.specular_color, 0.0, faces)
    return _is_always(material.metallic, 0.0, faces) and _is_always(material.ior, 1.0, faces)


def _is_always(value: Colored | Scalar, number: float, faces: Faces) -> bool:
    """Return whether all components of an input are `number` on all the faces."""
    return bool((_range(value, faces) == number).all())


def _range(value: Colored | Scalar, faces: Faces) -> Float:
    """Return (2, C) the lowest and the highest of each component of an input on the faces."""
    if isinstance(value, Texture):
        return extremes(value)
    if isinstance(value, Primvar):
        if any(value.name not in shape.primvars for shape, _ in faces):  # refused when it is rendered
            return np.array([[-np.inf], [np.inf]])
        numbers = [shape.primvars[value.name][shown].astype(np.float64) for shape, shown in faces]
        return np.stack([np.min([n.min((0, 1)) for n in numbers], 0), np.max([n.max((0, 1)) for n in numbers], 0)])
    return np.stack([np.atleast_1d(np.asarray(value, np.float64))] * 2)

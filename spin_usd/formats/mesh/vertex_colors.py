"""Colours of points, of faces or of corners, as PLY and OBJ have them beside their materials."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.scene.asset import MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.derived import srgb
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Primvar

DISPLAY_COLOR = "displayColor"
UNSAID = Material(path="vertex_colors")
TAKEN_AS_SRGB = "its colours are taken as sRGB"
BESIDE_TEXTURE = (
    "its vertex colours are ignored where a material has a texture: UsdPreviewSurface cannot multiply the two"
)


def linear_colors(encoded: Float) -> Float:
    """Return (N, 3) linear colours of sRGB ones, which reach to 1, or to 255 where any is above 1."""
    whole = encoded / 255 if (encoded > 1).any() else encoded
    return np.asarray(srgb.decode(np.clip(whole, 0, 1)))


def with_colors(asset: MeshAsset, colors: Sequence[Float | None]) -> MeshAsset:
    """Return the asset with `colors`, linear (C, 3) at the corners of each part, None for a part without.

    They multiply the diffuse colour of each face's material, as in three.js, or replace a missing one.
    """
    if all(part_colors is None for part_colors in colors):
        return asset
    materials, notes, parts = list(asset.materials), [TAKEN_AS_SRGB], []
    shown: dict[int, int] = {}
    for part, part_colors in zip(asset.parts, colors, strict=True):
        if part_colors is None:
            parts.append(part)
            continue
        parts.append(_colored(part, part_colors, materials, shown))
        if any("diffuseColor" in materials[index].images for index in np.unique(part.face_material) if index >= 0):
            notes.append(BESIDE_TEXTURE)
    return replace(asset, parts=tuple(parts), materials=tuple(materials), notes=(*asset.notes, *dict.fromkeys(notes)))


def _colored(part: MeshPart, colors: Float, materials: list[ModelMaterial], shown: dict[int, int]) -> MeshPart:
    """`part` with materials that show its colours; `shown` maps each original material to its index in `materials`."""
    face_material, factors = part.face_material.copy(), np.ones((len(part.face_counts), 3))
    for index in np.unique(part.face_material):
        material = materials[index] if index >= 0 else ModelMaterial(constants=UNSAID)
        diffuse = material.constants.diffuse_color
        if "diffuseColor" in material.images:
            continue
        faces = part.face_material == index
        if isinstance(diffuse, tuple) and diffuse != UNSAID.diffuse_color:
            factors[faces] = diffuse
        if index not in shown:
            shown[index] = len(materials)
            color = Primvar(name=DISPLAY_COLOR)
            materials.append(replace(material, constants=replace(material.constants, diffuse_color=color)))
        face_material[faces] = shown[index]
    primvars = {**part.primvars, DISPLAY_COLOR: colors * np.repeat(factors, part.face_counts, axis=0)}
    return replace(part, face_material=face_material, primvars=primvars)

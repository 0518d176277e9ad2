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
MOST_OF_ONE = 16.0
"""Greatest colour, not a whole number, that is taken as one of 0 to 1: of 0 to 255 it would be nearly black."""
UNSAID = Material(path="vertex_colors")
TAKEN_AS_SRGB = "its colours are taken as sRGB"
BESIDE_TEXTURE = (
    "its vertex colours are ignored where a material has a texture: UsdPreviewSurface cannot multiply the two"
)


def white(encoded: Float) -> float:
    """Return the value of a full colour in (N, 3) `encoded` ones: 255 where they are whole numbers, some above 1, or
    where the greatest is far above 1, else 1. Rounding, filters and bright light give colours a little above 1."""
    finite = encoded[np.isfinite(encoded)]
    most = finite.max(initial=0.0)
    return 255.0 if most > MOST_OF_ONE or (most > 1 and not (finite % 1).any()) else 1.0


def with_colors(asset: MeshAsset, colors: Sequence[Float | None]) -> MeshAsset:
    """Return the asset with `colors`, sRGB (C, 3) at the corners of each part, None for a part without.

    They multiply the diffuse colour of each face's material, as in three.js, or replace a missing one.
    """
    given = [part_colors for part_colors in colors if part_colors is not None]
    if not given:
        return asset
    most = white(np.concatenate(given))
    outside = sum(int(((each < 0) | (each > most)).any(axis=1).sum()) for each in given)
    materials, notes, parts = list(asset.materials), [TAKEN_AS_SRGB], []
    if outside:
        where = f"at {outside} of its {sum(len(each) for each in given)} corners"
        notes.append(f"{where} a colour is not within 0 and {most:g}: the nearest there was taken")
    shown: dict[int, int] = {}
    for part, part_colors in zip(asset.parts, colors, strict=True):
        if part_colors is None:
            parts.append(part)
            continue
        linear = srgb.decode(np.clip(part_colors / most, 0, 1))
        parts.append(_colored(part, linear, materials, shown))
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

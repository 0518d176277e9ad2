"""The library of spacecraft materials in stages/materials: the description of each, and copies of the layers."""

from dataclasses import fields
from pathlib import Path
from typing import Any

from pxr import Sdf

from spin_usd.basics.resources import bundled, bundled_names
from spin_usd.scene.derived.recognised_material import Vocabulary
from spin_usd.stage.author.diffuse_materials import TYPES, author_diffuse
from spin_usd.stage.author.lights_and_environment import composed
from spin_usd.stage.composition.copy_stage import copy_assets
from spin_usd.stage.composition.open_layer import open_layer
from spin_usd.stage.usd.layer_file import export
from spin_usd.stage.usd.shader_inputs import PREVIEW_SURFACE

CUSTOM = "spin"
"""The dictionary in the customData of a library's material."""
SURFACE = "Surface"
"""The UsdPreviewSurface of a library's material."""


def vocabulary() -> Vocabulary:
    """Return the words that identify which surface has which material."""
    found: dict[str, dict[str, str]] = {each.name: {} for each in fields(Vocabulary)}
    for name in bundled_names("material"):
        layer = open_layer(bundled("material", name))
        said = layer.GetPrimAtPath(layer.GetDefaultPrimAsPath()).customData[CUSTOM]
        for tier, words in found.items():
            words |= dict.fromkeys(said.get(tier, ()), name)
    return Vocabulary(**found)


def copy_material(name: str, folder: Path) -> None:
    """Copy a material's layer into `folder`, and its images beside it. Raises OutputError."""
    file = bundled("material", name)
    layer = open_layer(file)
    copy = composed(layer, file)
    copy.documentation = layer.documentation
    copy_assets(copy, folder / "textures")
    export(copy, folder / f"{name}.usda")


def author_matt(surface: Sdf.PrimSpec, material: str) -> None:
    """Make the surface of a material of the library diffuse, and leave out its normal map."""
    author_diffuse(surface)
    if "inputs:normal" in shader_inputs(material, PREVIEW_SURFACE)[SURFACE]:
        Sdf.AttributeSpec(surface, "inputs:normal", TYPES.Normal3f).connectionPathList.ClearEditsAndMakeExplicit()


def shader_inputs(name: str, node: str) -> dict[str, dict[str, Any]]:
    """Return the constant inputs of the shaders of a material whose info:id is `node`: values by input, by shader."""
    layer = open_layer(bundled("material", name))
    shaders = layer.GetPrimAtPath(layer.GetDefaultPrimAsPath()).nameChildren
    of_kind = [each for each in shaders if each.attributes["info:id"].default == node]
    return {each.name: {of.name: of.default for of in each.attributes} for each in of_kind}

"""The layers of the library: one for each material. The same table always gives the same text."""

from collections.abc import Mapping
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

from materials.library_material import LibraryMaterial
from materials.network import author
from materials.words import TIERS

TEXTURE_FOLDER = "textures"


def write_layers(folder: Path, library: Mapping[str, LibraryMaterial]) -> None:
    """Write NAME.usda for each material into an existing folder."""
    for name, material in library.items():
        stage = Usd.Stage.CreateNew(str(folder / f"{name}.usda"))
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        made = UsdShade.Material.Define(stage, Sdf.Path.absoluteRootPath.AppendChild(name))
        stage.SetDefaultPrim(made.GetPrim())
        stage.GetRootLayer().documentation = f"{material.about} {material.source} Made by tools/build_materials."
        made.GetPrim().SetCustomDataByKey("spin", {**_limits(material), **_words(name)})
        author(made, material.values, lambda file: f"./{TEXTURE_FOLDER}/{file}")
        stage.Save()


def _words(name: str) -> dict[str, object]:
    """By which words it is told that something is made of the material."""
    return {tier: Vt.StringArray(list(words[name])) for tier, words in TIERS.items() if name in words}


def _limits(material: LibraryMaterial) -> dict[str, object]:
    """What may be drawn in place of the material's own numbers."""
    found = {
        "kind": material.kind,
        "pattern": material.pattern and Gf.Vec2f(*material.pattern),
        "roughness": Gf.Vec2f(*material.roughness),
        "middle": material.middle,
        "colors": Vt.Vec3fArray([Gf.Vec3f(*each) for each in material.colours]),
        "scale": material.scale and Gf.Vec2f(*material.scale),
    }
    return {name: value for name, value in found.items() if value is not None}

"""One look: a Material for every name."""

from collections.abc import Mapping

from materials.network import author
from materials.values import MaterialValues
from pxr import Sdf, Usd, UsdGeom, UsdShade

from tango.paths import MATERIALS, ROOT


def look(stage: Usd.Stage, materials: Mapping[str, MaterialValues]) -> None:
    """Author the materials into a stage for them alone."""
    UsdGeom.Scope.Define(stage, MATERIALS)
    for name, values in materials.items():
        material = UsdShade.Material.Define(stage, MATERIALS.AppendChild(name))
        author(material, values, lambda file: f"./textures/{file}")
    stage.GetRootLayer().GetPrimAtPath(ROOT).specifier = Sdf.SpecifierOver
    stage.Save()

"""One look: a Material for every name, by itself or as a reference to the library's, with opinions where it differs."""

from collections.abc import Mapping

from materials.network import author
from materials.table import LIBRARY
from materials.values import MaterialValues
from pxr import Sdf, Usd, UsdGeom, UsdShade

from tango.materials import OF_LIBRARY
from tango.paths import MATERIALS, ROOT
from tango.textures import TEXTURES

LIBRARY_FOLDER = "../../materials"


def look(stage: Usd.Stage, materials: Mapping[str, MaterialValues], *, of_library: bool) -> None:
    """Author the materials into a stage for them alone; `of_library`: as what differs from the library's."""
    UsdGeom.Scope.Define(stage, MATERIALS)
    for name, values in materials.items():
        path = MATERIALS.AppendChild(name)
        if of_library:
            _over_library(stage.GetRootLayer(), path, OF_LIBRARY[name], values)
        else:
            author(UsdShade.Material.Define(stage, path), values, _where)
    stage.GetRootLayer().GetPrimAtPath(ROOT).specifier = Sdf.SpecifierOver
    stage.Save()


def _where(file: str) -> str:
    return f"./textures/{file}" if file in TEXTURES else f"{LIBRARY_FOLDER}/textures/{file}"


def _over_library(layer: Sdf.Layer, path: Sdf.Path, name: str, values: MaterialValues) -> None:
    """Write a reference to the library's material, and over it what of `values` it does not have already."""
    scratch = Usd.Stage.CreateInMemory()
    base, own = (UsdShade.Material.Define(scratch, Sdf.Path(root)) for root in ("/Base", "/Own"))
    author(base, LIBRARY[name].values, _where)
    own.GetPrim().GetReferences().AddInternalReference(base.GetPath())
    author(own, values, _where)
    _prune(scratch.GetRootLayer(), own.GetPath(), base.GetPath())
    with Sdf.ChangeBlock():
        Sdf.CopySpec(scratch.GetRootLayer(), own.GetPath(), layer, path)
        references = layer.GetPrimAtPath(path).referenceList
        references.ClearEditsAndMakeExplicit()
        references.explicitItems.append(Sdf.Reference(f"{LIBRARY_FOLDER}/{name}.usda"))


def _prune(layer: Sdf.Layer, own: Sdf.Path, base: Sdf.Path) -> None:
    """Remove from the prim `own` and those below it what they share with `base`."""
    prim, shared = layer.GetPrimAtPath(own), layer.GetPrimAtPath(base)
    for attribute in list(prim.properties):
        there = shared.properties.get(attribute.name)
        if there and _said(attribute, own.GetPrefixes()[0]) == _said(there, base.GetPrefixes()[0]):
            prim.RemoveProperty(attribute)
    for child in list(prim.nameChildren):
        if child.name in shared.nameChildren:
            _prune(layer, child.path, base.AppendChild(child.name))
            child.specifier, child.typeName = Sdf.SpecifierOver, ""
            if not child.properties:
                del prim.nameChildren[child.name]


def _said(attribute: Sdf.AttributeSpec, root: Sdf.Path) -> tuple[object, list[Sdf.Path]]:
    """What an attribute's opinion is: its value, and what it is connected to below `root`."""
    connected = attribute.connectionPathList.GetAddedOrExplicitItems()
    return attribute.default, [path.MakeRelativePath(root) for path in connected]

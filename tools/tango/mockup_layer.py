"""What the look `mockup` has besides materials: parts of another shape, and parts that wear another material."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from tango.geometry_layer import mesh
from tango.parts.mockup import SHAPES, covered
from tango.parts.spacecraft import Part
from tango.paths import MATERIALS, ROOT

COVERED = ("Deck",)
"""Parts that keep their shape, but each face wears what the nearest wall does."""


def mockup(stage: Usd.Stage, parts: Sequence[Part]) -> None:
    """Author the opinions into the stage of the look."""
    for part in parts:
        if part.name in SHAPES:
            other = replace(part, shape=SHAPES[part.name]())
            mesh(stage, other)
            _leave_out(stage, part, other.shape.materials)
            _wear(stage, part.name, other.shape.materials)
        elif part.name in COVERED:
            materials = covered(part.shape).materials
            _faces(stage, part, materials)
            _leave_out(stage, part, materials)
            _wear(stage, part.name, materials)
    stage.Save()


def _faces(stage: Usd.Stage, part: Part, materials: Sequence[str]) -> None:
    """The faces of each of several materials, as subsets of the same mesh."""
    for name in dict.fromkeys(materials):
        subset = UsdGeom.Subset.Define(stage, ROOT.AppendChild(part.name).AppendChild(name))
        subset.CreateElementTypeAttr(UsdGeom.Tokens.face)
        subset.CreateFamilyNameAttr(UsdShade.Tokens.materialBind)
        subset.CreateIndicesAttr(np.flatnonzero(np.array(materials) == name).tolist())
    stage.GetRootLayer().GetPrimAtPath(ROOT.AppendChild(part.name)).specifier = Sdf.SpecifierOver


def _leave_out(stage: Usd.Stage, part: Part, materials: Sequence[str]) -> None:
    """Deactivate the subsets that hold no face any more."""
    for name in dict.fromkeys(part.shape.materials):
        if name not in materials or len(set(materials)) == 1:
            stage.OverridePrim(ROOT.AppendChild(part.name).AppendChild(name)).SetActive(False)


def _wear(stage: Usd.Stage, part: str, materials: Sequence[str]) -> None:
    path = ROOT.AppendChild(part)
    for name in set(materials):
        _bind(stage.OverridePrim(path if len(set(materials)) == 1 else path.AppendChild(name)), name)


def _bind(prim: Usd.Prim, name: str) -> None:
    UsdShade.MaterialBindingAPI.Apply(prim)
    binding = prim.CreateRelationship(UsdShade.Tokens.materialBinding, custom=False)
    binding.SetTargets([MATERIALS.AppendChild(name)])

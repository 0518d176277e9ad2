"""The material that a prim is bound to."""

from typing import Any

from pxr import Usd, UsdShade

from spin_usd.stage.composition.materialx import document_of
from spin_usd.stage.usd.notes import Notes

SHOWN_INSTEAD = "what is bound to it is rendered in its displayColor, or grey"


def bound_material(prim: Usd.Prim, notes: Notes) -> UsdShade.Material | None:
    """Find the material of `prim`, a gprim or a GeomSubset, by USD's own rules; None where nothing is bound.

    A binding to what is no material binds nothing, by those rules; it is noted.
    """
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)
    if material:
        return material
    _note_dangling(prim, notes)
    return None


def _note_dangling(prim: Usd.Prim, notes: Notes) -> None:
    """Note the nearest binding, here or above, to a prim that is not a material: it must not silently become grey."""
    while prim and not prim.IsPseudoRoot():
        for name in ("material:binding", "material:binding:full"):
            relation = prim.GetRelationship(name)
            lost = relation.GetTargets() or _lost_targets(relation) if relation else []
            document = document_of(prim.GetStage(), lost[0]) if lost else ""
            if document:
                notes.add(
                    "material-foreign", lost[0], f"is defined by @{document}@, which is not read: {SHOWN_INSTEAD}"
                )
                return
            if lost:
                notes.add(
                    "material-missing",
                    prim.GetPath(),
                    f"is bound to {lost[0]}, which is not a material: {SHOWN_INSTEAD}",
                )
                return
        prim = prim.GetParent()


def _lost_targets(relation: Usd.Relationship) -> list[Any]:
    """Return the strongest opinion's targets where USD only warns and finds none: paths outside a reference."""
    if relation.GetTargets():
        return []
    specs = [spec for spec in relation.GetPropertyStack(Usd.TimeCode.Default()) if spec.HasInfo("targetPaths")]
    return list(specs[0].targetPathList.GetAddedOrExplicitItems()) if specs else []

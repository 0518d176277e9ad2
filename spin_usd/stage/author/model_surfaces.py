"""The surfaces of a model: geometry with its own name and material."""

from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from spin_usd.errors import InputError
from spin_usd.scene.material import LIMITS, Material
from spin_usd.scene.name_rule import Color, NameRule
from spin_usd.stage.read.bodies.face_subsets import binds_material, find_subsets
from spin_usd.stage.read.bodies.part_labels import labels_of_target
from spin_usd.stage.read.shapes.primvars import DISPLAY_COLOR
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.shader_inputs import PREVIEW_SURFACE
from spin_usd.stage.usd.values import DEFAULT_TIME, TEXTS, read, read_any
from spin_usd.stage.usd.visibility import PROXIES

NO_SURFACES = (UsdGeom.Points, UsdGeom.Curves)
NOTHING_SAID = Material(path="")
TOLD = ("diffuseColor", "emissiveColor", "opacity")


@dataclass(frozen=True, kw_only=True)
class ModelSurface:
    """A gprim, or a subset of its faces that has a material of its own."""

    path: Sdf.Path
    names: tuple[str, ...]
    """Its name, the names of prims above it, and their paths below the model."""
    materials: tuple[str, ...]
    """Names of its material."""
    class_name: str
    """Its class."""
    instances: tuple[Sdf.Path, ...]
    """Paths of the instances that hold it."""
    bare: bool
    """True if it has no colour, and no material with a value."""
    color: Color | None
    """Its one opaque colour; None where it has none, several or an image, and where it shines by itself."""
    below: str
    """Its path below the model."""
    bound: Sdf.Path | None
    """The path of its material; None where it has none."""
    overruling: tuple[Sdf.Path, ...]
    """Paths of the groups above it whose materials override their contents'."""
    purposes: tuple[str, ...]
    """The relationships by which it or a group above it binds a material for one purpose alone."""
    collected: bool
    """Whether a collection gives it its material."""

    @property
    def all_names(self) -> tuple[str, ...]:
        """Return its names and its material's, for patterns to match."""
        return self.names + self.materials

    @property
    def title(self) -> str:
        """Return the name of its material, its own where it is bare or has a colour alone."""
        return self.materials[-1] if self.materials and not self.bare else self.path.name

    @property
    def patterned(self) -> bool:
        """Return whether it has a material or colours that are more than one opaque colour."""
        return not self.bare and self.color is None


def model_surfaces(target: Usd.Prim, model: Usd.Prim) -> Iterator[ModelSurface]:
    """Yield the surfaces of all gprims at and below `model`, which is below `target` or is it."""
    for prim in Usd.PrimRange(model, PROXIES):
        if prim.IsA(UsdGeom.Gprim) and not any(prim.IsA(kind) for kind in NO_SURFACES):
            yield _surface(prim, target, model)
            for subset in find_subsets(prim):
                if binds_material(subset):
                    yield _surface(subset.GetPrim(), target, model)


def refuse_idle(
    rules: Sequence[NameRule], found: Sequence[ModelSurface], used: Container[NameRule], where: object
) -> None:
    """Raise InputError for a rule of the table `where` that is not among those `used`."""
    for rule in rules:
        if rule in used:
            continue
        if any(rule.matches(each.all_names) for each in found):
            what, do = "matches only surfaces that rows before it match", "put it before them, or remove it"
        else:
            materials = dict.fromkeys(each.materials[-1] for each in found if each.materials)
            prims = dict.fromkeys(each.names[0] for each in found) | dict.fromkeys(each.names[-1] for each in found)
            what = "matches nothing"
            do = f"the materials are {', '.join(materials) or 'none'}; the prims are {', '.join(prims)}"
            do += "; [...] means one of its characters, [[] a bracket" * ("[" in rule.pattern)
        raise InputError(f"the pattern {rule.pattern!r} {what}", where=where, do=do)


def _surface(prim: Usd.Prim, target: Usd.Prim, model: Usd.Prim) -> ModelSurface:
    stage, root = prim.GetStage(), model.GetPath()
    chain = [stage.GetPrimAtPath(path) for path in prim.GetPath().GetPrefixes() if path.HasPrefix(root)]
    labels = labels_of_target(target)
    for each in chain:
        labels = labels.below(each)
    below = [each for each in chain if each != model] or chain
    paths = [str(each.GetPath().MakeRelativePath(root)) for each in below]
    material, binding = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)
    blank = bool(material) and _is_blank(material)
    displayed = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(DISPLAY_COLOR)
    shown = read_any(displayed.GetAttr()) if displayed else None
    return ModelSurface(
        path=prim.GetPath(),
        names=_unique(*map(prim_names, below), paths),
        materials=_unique(prim_names(material.GetPrim())) if material else (),
        class_name=labels.class_name,
        instances=tuple(each.GetPath() for each in chain if each.IsInstance()),
        bare=blank or not (material or shown),
        color=None if blank else _color_of(material) if material else _only(shown),
        below=paths[-1],
        bound=material.GetPath() if material else None,
        overruling=tuple(each.GetPath() for each in chain[:-1] if any(map(_is_stronger, _bindings(each)))),
        purposes=tuple({each.GetName(): None for group in chain for each in _bindings(group)[1:]}),
        collected=bool(material) and "collection" in binding.SplitName(),
    )


def _bindings(prim: Usd.Prim) -> list[Usd.Relationship]:
    """Return the relationships by which a prim may bind a material: for all purposes, and for single ones."""
    own = UsdShade.MaterialBindingAPI(prim)
    of_purposes = (own.GetDirectBindingRel(each) for each in (UsdShade.Tokens.full, UsdShade.Tokens.preview))
    return [own.GetDirectBindingRel(), *(each for each in of_purposes if each and each.HasAuthoredTargets())]


def _is_stronger(binding: Usd.Relationship) -> bool:
    """Return whether a group's binding overrides its contents'."""
    strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(binding) if binding else ""
    return bool(strength == UsdShade.Tokens.strongerThanDescendants)


def prim_names(prim: Usd.Prim) -> list[str]:
    """Return its prim name, the names of its groups, its display name, and the names of its part labels."""
    groups, labels = (
        read(prim.GetAttribute(name), DEFAULT_TIME, *TEXTS) or () for name in (schema.GROUP_LABELS, schema.PART_LABELS)
    )
    return [name for name in (prim.GetName(), *groups, prim.GetDisplayName(), *labels) if name]


def _unique(*names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for each in names for name in each))


def _constants(material: UsdShade.Material) -> dict[str, UsdShade.Input] | None:
    """Return the inputs of a material's UsdPreviewSurface by name; None where it has none, or one with connections."""
    shader = material.ComputeSurfaceSource()[0]
    if not shader or read(shader.GetIdAttr()) != PREVIEW_SURFACE:
        return None
    inputs = {each.GetBaseName(): each for each in shader.GetInputs()}
    return None if any(each.HasConnectedSource() for each in inputs.values()) else inputs


def _is_blank(material: UsdShade.Material) -> bool:
    """Return whether a material has only default values, like the one of mesh files without materials."""
    if (inputs := _constants(material)) is None:
        return False
    fields = {limits.name: getattr(NOTHING_SAID, of) for of, limits in LIMITS.items()}
    values = {name: read_any(each.GetAttr()) for name, each in inputs.items() if name in fields}
    return all(value is None or np.allclose(value, fields[name] or 0) for name, value in values.items())


def _color_of(material: UsdShade.Material) -> Color | None:
    """Return the one colour of a material of UsdPreviewSurface that is opaque, emits nothing and has no images."""
    if (inputs := _constants(material)) is None:
        return None
    values = {name: read(inputs[name].GetAttr()) if name in inputs else None for name in TOLD}
    if any(values["emissiveColor"] or ()) or (values["opacity"] is not None and values["opacity"] < 1):
        return None
    return _only([values["diffuseColor"] or (0.18, 0.18, 0.18)])


def _only(colors: Any) -> Color | None:
    """Return the common colour of `colors`; None for none, several, and values that are not colours."""
    found = np.asarray([] if colors is None else colors, np.float64)
    if found.ndim != 2 or found.shape[1] != 3 or not len(found) or (found != found[0]).any():
        return None
    red, green, blue = found[0].tolist()
    return red, green, blue

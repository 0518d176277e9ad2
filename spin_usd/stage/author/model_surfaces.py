"""The surfaces of a model, each with all the names by which a user may refer to it."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from pxr import Sdf, Usd, UsdGeom, UsdShade

from spin_usd.stage.read.target.face_subsets import binds_material, find_subsets
from spin_usd.stage.read.target.part_labels import labels_of_target
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import DEFAULT_TIME, TEXTS, read
from spin_usd.stage.usd.visibility import PROXIES

NO_SURFACES = (UsdGeom.Points, UsdGeom.Curves)


@dataclass(frozen=True, kw_only=True)
class ModelSurface:
    """A gprim, or a subset of its faces that has a material of its own.

    names: its own and those of the prims above it, and their paths below the model · materials: names of its material ·
    class_name: its class · instances: paths of the instances that hold it.
    """

    path: Sdf.Path
    names: tuple[str, ...]
    materials: tuple[str, ...]
    class_name: str
    instances: tuple[Sdf.Path, ...]


def model_surfaces(target: Usd.Prim, model: Usd.Prim) -> Iterator[ModelSurface]:
    """Yield the surfaces of all gprims at and below `model`, which is below `target`."""
    for prim in Usd.PrimRange(model, PROXIES):
        if prim.IsA(UsdGeom.Gprim) and not any(prim.IsA(kind) for kind in NO_SURFACES):
            yield _surface(prim, target, model)
            for subset in find_subsets(prim):
                if binds_material(subset):
                    yield _surface(subset.GetPrim(), target, model)


def _surface(prim: Usd.Prim, target: Usd.Prim, model: Usd.Prim) -> ModelSurface:
    stage, root = prim.GetStage(), model.GetPath()
    chain = [stage.GetPrimAtPath(path) for path in prim.GetPath().GetPrefixes() if path.HasPrefix(root)]
    labels = labels_of_target(target)
    for each in chain:
        labels = labels.below(each)
    below = [each for each in chain if each != model] or chain
    paths = [str(each.GetPath().MakeRelativePath(root)) for each in below]
    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    return ModelSurface(
        path=prim.GetPath(),
        names=_unique(*map(_names, below), paths),
        materials=_unique(_names(material.GetPrim())) if material else (),
        class_name=labels.class_name,
        instances=tuple(each.GetPath() for each in chain if each.IsInstance()),
    )


def _names(prim: Usd.Prim) -> list[str]:
    """Return its prim name, its display name, and the names of its part labels."""
    labels = read(prim.GetAttribute(schema.PART_LABELS), DEFAULT_TIME, *TEXTS) or ()
    return [name for name in (prim.GetName(), prim.GetDisplayName(), *labels) if name]


def _unique(*names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for each in names for name in each))

"""A USD target within a stage's folder, and the data read from it before the stage is written."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pxr import Usd, UsdGeom

from spin_usd.errors import InputError
from spin_usd.stage.author.target_root import holds_geometry
from spin_usd.stage.composition.materialx import composition_errors
from spin_usd.stage.composition.open_stage import open_as_it_is
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.root_metadata import METRES_PER_UNIT, UNITS, root_number
from spin_usd.stage.usd.values import read

UNIT_TOLERANCE = 1e-6  # relative: metersPerUnit is often a rounded inverse


@dataclass(frozen=True, kw_only=True)
class TargetAsset:
    """A target within a stage's folder."""

    name: str
    file: Path
    """Its layer there."""
    prim: str | None
    """Its root; None for the default prim."""
    metres_per_unit: float
    xformable: bool
    """Whether the root's type has a transform."""
    has_kind: bool
    """Whether the root has a kind."""
    order: tuple[str, ...]
    """The root's xformOpOrder."""
    keypoints: str | None
    """Path of the Points prim below the root, or None."""
    gprims: int
    """The number of gprims outside instances."""
    variants: Mapping[str, tuple[str, ...]]
    """The variants of each variant set of the root."""
    source_prim: str | None = None
    """Path of the root in the file that was given."""
    notes: tuple[str, ...] = ()
    """Sentences on which prims of that file are the target."""
    left_out: bool = False
    """Whether some of the file is left out."""
    up: str = ""
    """The file's up axis; empty if not stated."""


def describe(
    file: Path,
    name: str,
    units_per_metre: float | None = None,
    *,
    prim: str | None = None,
    source: Path | None = None,
) -> TargetAsset:
    """Describe the asset in `file`: all at and below `prim`, or its default prim. Raises InputError that names the
    file, or `source`, which it is a copy of."""
    where = source or file
    stage = open_source(file)
    root = stage.GetPrimAtPath(prim) if prim else stage.GetDefaultPrim()
    _refuse_nested_targets(root, where)
    found = gprims_of(root)
    if not holds_geometry(root):
        raise InputError("holds no geometry", where=where, do=_unselected(root))
    keypoints = [prim for prim in found if prim.IsA(UsdGeom.Points) and prim.HasAttribute(schema.KEYPOINT_NAME)]
    xformable = root.IsA(UsdGeom.Xformable)
    order = read(UsdGeom.Xformable(root).GetXformOpOrderAttr()) if xformable else None
    return TargetAsset(
        name=name,
        file=file,
        prim=prim,
        metres_per_unit=_metres_per_unit(stage, where, units_per_metre),
        xformable=xformable,
        has_kind=bool(Usd.ModelAPI(root).GetKind()),
        keypoints=str(keypoints[0].GetPath().MakeRelativePath(root.GetPath())) if keypoints else None,
        gprims=len(found) - len(keypoints),
        order=tuple(order or ()),
        up=str(UsdGeom.GetStageUpAxis(stage)).lower(),
        variants={name: tuple(root.GetVariantSet(name).GetVariantNames()) for name in root.GetVariantSets().GetNames()},
    )


def gprims_of(root: Usd.Prim) -> list[Usd.Prim]:
    """List the gprims at and below `root` outside instances."""
    return [prim for prim in Usd.PrimRange(root) if prim.IsA(UsdGeom.Gprim)]


def _unselected(root: Usd.Prim) -> str | None:
    """Return a note on the variant sets of a prim without selection, and how to select; None if there are none."""
    sets = root.GetVariantSets()
    free = [name for name in sets.GetNames() if not sets.GetVariantSelection(name)]
    each = ((name, variant) for name in free for variant in sets.GetVariantSet(name).GetVariantNames())
    named = " or ".join(f"--variant {name}={variant}" for name, variant in each)
    return f"its variant sets {', '.join(free)} have no selection: give {named}" if free else None


def select_variants(root: Usd.Prim, variants: Mapping[str, str], where: object) -> None:
    """Select `variants` by their sets, in the stage's edit target. Raises InputError for variants that `root` does not
    have."""
    for name, variant in variants.items():
        found = root.GetVariantSets()
        known = found.GetVariantSet(name).GetVariantNames() if name in found.GetNames() else ()
        if variant not in known:
            do = f"choose {', '.join(known)}" if known else f"its sets are {', '.join(found.GetNames()) or 'none'}"
            raise InputError(f"{root.GetPath()} has no variant {name}={variant}", where=where, do=do)
        found.SetSelection(name, variant)


def open_source(source: Path) -> Usd.Stage:
    """Open the stage in a user's file. Raises StageError for a file that must not be opened, InputError if it does not
    compose."""
    stage = open_as_it_is(source)
    errors = composition_errors(stage)
    if errors:
        raise InputError(f"does not compose: {errors[0]}", where=source)
    return stage


def _refuse_nested_targets(root: Usd.Prim, source: Path) -> None:
    """Raise InputError for SpinTargetAPI below the root. On the root it is allowed: the stage removes it there."""
    nested = [prim for prim in Usd.PrimRange(root) if prim != root and prim.HasAPI(schema.TARGET_API)]
    if nested:
        found = f"its prim {nested[0].GetPath()} has {schema.TARGET_API}, which only the whole target may have"
        raise InputError(found, where=source, do="remove it there")


def _metres_per_unit(stage: Usd.Stage, source: Path, units_per_metre: float | None) -> float:
    authored = root_number(stage, METRES_PER_UNIT) if UsdGeom.StageHasAuthoredMetersPerUnit(stage) else None
    if authored is None and units_per_metre is None:
        raise InputError(
            "does not author metersPerUnit",
            where=source,
            do="author it, or give --units-per-metre, for example 100 for centimetres",
        )
    if authored is not None and not UNITS[0] <= authored <= UNITS[1]:
        do = f"author a number above zero, {UNITS[0]:g} to {UNITS[1]:g}"
        raise InputError(f"has metersPerUnit {authored}", where=source, do=do)
    if authored is None:
        assert units_per_metre is not None
        return 1 / units_per_metre
    if units_per_metre is not None and abs(authored * units_per_metre - 1) > UNIT_TOLERANCE:
        raise InputError(
            f"has metersPerUnit {authored:g}, but {units_per_metre:g} units per metre were given",
            where=source,
            do="leave --units-per-metre out",
        )
    return authored

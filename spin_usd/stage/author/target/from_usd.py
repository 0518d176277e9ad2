"""A USD target, given as a file or by the name of one that travels with spin_usd, copied with all it depends on."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils

from spin_usd.errors import InputError
from spin_usd.stage.author.target.gathered_roots import gather_roots
from spin_usd.stage.author.target.target_root import holds_geometry, notes_on_root, outside, target_root
from spin_usd.stage.composition.backslashes import slashes
from spin_usd.stage.composition.materialx import composition_errors
from spin_usd.stage.composition.missing_images import dispensable_images
from spin_usd.stage.composition.open_stage import silenced
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import open_layer, reason, writing
from spin_usd.stage.usd.root_metadata import METRES_PER_UNIT, root_number

LAYER_SUFFIXES = {".usd", ".usda", ".usdc"}
UNIT_TOLERANCE = 1e-6  # relative: metersPerUnit is often a rounded inverse


@dataclass(frozen=True, kw_only=True)
class TargetAsset:
    """A target within a stage's folder.

    file: its layer there · prim: its root, None for the default prim · xformable: whether the root's type has a
    transform · has_kind: whether the root has a kind · order: the root's xformOpOrder · keypoints: path of the Points
    prim below the root, or None · gprims: the number of gprims outside instances · variants: the variants of each
    variant set of the root · source_prim: path of the root in the file that was given · notes: sentences on which prims
    of that file are the target.
    """

    name: str
    file: Path
    prim: str | None
    metres_per_unit: float
    xformable: bool
    has_kind: bool
    order: tuple[str, ...]
    keypoints: str | None
    gprims: int
    variants: Mapping[str, tuple[str, ...]]
    source_prim: str | None = None
    notes: tuple[str, ...] = ()


def copy_usd_target(
    source: Path, folder: Path, name: str, units_per_metre: float | None, prim: str | None = None
) -> TargetAsset:
    """Copy the asset at `source` with all it depends on into `folder`, which must not exist yet. `prim` is the path of
    the target in it, where that is not the default prim.

    Raises InputError that names the file, OutputError when the copy cannot be written.
    """
    open_layer(source)
    with silenced(), _readable(source), slashes(source):
        incomplete = _refuse_missing(source)
        stage = _opened(source)
        root = target_root(stage, source, prim)
        alone = _stands_alone(stage, source, root)
        with writing(folder):
            folder.mkdir(parents=True)
            copied = UsdUtils.LocalizeAsset(Sdf.AssetPath(str(source)), str(folder))
            _anchor(folder)
        file = folder / source.resolve().name
        if not (copied or incomplete) or composition_errors(Usd.Stage.Open(str(file))):
            raise InputError("cannot be copied with what it depends on", where=source)
        if not alone:
            file = gather_roots(file, root)
        chosen = str(root) if alone and root != stage.GetDefaultPrim().GetPath() else None
        found = describe(file, name, units_per_metre, prim=chosen, source=source)
        return replace(found, source_prim=str(root), notes=notes_on_root(stage, root, prim))


def _stands_alone(stage: Usd.Stage, source: Path, root: Sdf.Path) -> bool:
    """Return whether a reference to `root` includes all that it uses. Raises InputError for a relationship to a missing
    prim."""
    if root == Sdf.Path.absoluteRootPath:
        return False
    found = list(outside(stage, root))
    lost = next(((prim, path) for prim, path in found if not stage.GetPrimAtPath(path)), None)
    if lost:
        raise InputError(f"its prim {lost[0].GetPath()} refers to {lost[1]}, which is not there", where=source)
    return not found


@contextmanager
def _readable(source: Path) -> Iterator[None]:
    """Name the source file in the error where a file that it depends on cannot be read."""
    try:
        yield
    except Tf.ErrorException as error:
        raise InputError(f"depends on a file that cannot be read: {reason(error)}", where=source) from None


def _refuse_missing(source: Path) -> bool:
    """Return whether images are missing that have fallbacks. Raises InputError for other missing files."""
    unresolved = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(source)))[2]
    dispensable = dispensable_images(Usd.Stage.Open(str(source))) if unresolved else set()
    needed = [path for path in unresolved if Path(path).resolve() not in dispensable]
    if needed:
        raise InputError(
            f"depends on {len(needed)} missing files, such as {Path(needed[0]).name!r}",
            where=source,
            do="put them where the layer looks for them",
        )
    return bool(unresolved)


def _anchor(folder: Path) -> None:
    """Make every asset path of the copy relative to its own layer, with "./" or "../" first.

    USD writes some relative to the copy's folder, which it finds only as long as the copy is the root layer.
    """

    def anchored(path: str, beside: Path) -> str:
        if not path or path[0] in "./":
            return path
        file = path.partition("[")[0]
        return f"./{path}" if (beside / file).exists() else os.path.relpath(folder / path, beside)

    for layer_file in sorted(folder.rglob("*")):
        if layer_file.is_file() and layer_file.suffix in LAYER_SUFFIXES:
            layer = Sdf.Layer.FindOrOpen(str(layer_file))
            UsdUtils.ModifyAssetPaths(layer, partial(anchored, beside=layer_file.parent))
            layer.Save()


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
    stage = _opened(file)
    root = stage.GetPrimAtPath(prim) if prim else stage.GetDefaultPrim()
    _refuse_nested_targets(root, where)
    found = [prim for prim in Usd.PrimRange(root) if prim.IsA(UsdGeom.Gprim)]
    if not holds_geometry(root):
        raise InputError("holds no geometry", where=where)
    keypoints = [prim for prim in found if prim.IsA(UsdGeom.Points) and prim.HasAttribute(schema.KEYPOINT_NAME)]
    xformable = root.IsA(UsdGeom.Xformable)
    order = UsdGeom.Xformable(root).GetXformOpOrderAttr().Get() if xformable else None
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
        variants={name: tuple(root.GetVariantSet(name).GetVariantNames()) for name in root.GetVariantSets().GetNames()},
    )


def _opened(source: Path) -> Usd.Stage:
    try:
        stage = Usd.Stage.Open(str(source))
    except Tf.ErrorException as error:
        do = "write it again with a program that follows USD's types"
        raise InputError(f"USD cannot read it: {reason(error)}", where=source, do=do) from None
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
    if authored is not None and not 0 < authored < float("inf"):
        raise InputError(f"has metersPerUnit {authored}", where=source, do="author a number above zero")
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

"""One difference between two compositions applied to the first alone, in its session layer, to see what it does."""

from typing import TypeAlias

from pxr import Sdf, Tf, Usd

from spin_usd.errors import StageError
from spin_usd.records.difference import (
    ACTIVE,
    FILE,
    METADATA,
    PRIM,
    RELATIONSHIP,
    SCHEMAS,
    SELECTION,
    Difference,
)
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.usd.parser_faults import reason

Stage: TypeAlias = Usd.Stage
"""A stage's type, for callers outside this package, which do not import pxr."""


def can_apply(difference: Difference, stage: Usd.Stage) -> bool:
    """Return whether `stage` can be given that difference alone. The effects of a selection or a file are listed as
    differences of their own, and an instance cannot differ from the others."""
    if difference.kind in (FILE, SELECTION):
        return False
    path = Sdf.Path(difference.where).GetPrimPath()
    while not (prim := stage.GetPrimAtPath(path)):
        path = path.GetParentPath()
    return not prim.IsInstanceProxy()


def apply_difference(difference: Difference, of: Usd.Stage, to: Usd.Stage) -> None:
    """Give `to`, in its session layer, what `of` has at the place of `difference`, one that can be transplanted.

    Raises StageError where USD refuses.
    """
    try:
        with Usd.EditContext(to, to.GetSessionLayer()):
            _apply(difference, Sdf.Path(difference.where), of, to)
    except Tf.ErrorException as error:
        raise StageError(reason(error), where=difference.where) from None


def add_schemas(where: str, of: Usd.Stage, to: Usd.Stage) -> None:
    """Apply to the prim of the property `where` in `to` the schemas that only `of` applies there; nothing for prims."""
    path = Sdf.Path(where)
    if not path.IsPropertyPath():
        return
    prims = [stage.GetPrimAtPath(path.GetPrimPath()) for stage in (to, of)]
    own, others = (prim.GetPrimTypeInfo().GetAppliedAPISchemas() for prim in prims)
    if more := [name for name in others if name not in own]:
        with Usd.EditContext(to, to.GetSessionLayer()):
            prims[0].SetMetadata("apiSchemas", Sdf.TokenListOp.CreateExplicit([*own, *more]))


def _apply(difference: Difference, path: Sdf.Path, of: Usd.Stage, to: Usd.Stage) -> None:
    prim = to.OverridePrim(path.GetPrimPath())
    if difference.kind == PRIM:
        _prim(path, of, to)
    elif difference.kind == ACTIVE:
        prim.SetActive(of.GetPrimAtPath(path).IsActive())
    elif difference.kind == SCHEMAS:
        names = of.GetPrimAtPath(path).GetPrimTypeInfo().GetAppliedAPISchemas()
        prim.SetMetadata("apiSchemas", Sdf.TokenListOp.CreateExplicit(names))
    elif difference.kind == METADATA:
        name, source = difference.name, of.GetObjectAtPath(path)
        if source.HasAuthoredMetadata(name):
            to.GetObjectAtPath(path).SetMetadata(name, source.GetMetadata(name))
    elif difference.kind == RELATIONSHIP:
        source = of.GetRelationshipAtPath(path)
        prim.CreateRelationship(path.name).SetTargets(source.GetTargets() if source else [])
    else:
        _attribute(path, of, prim)


def _prim(path: Sdf.Path, of: Usd.Stage, to: Usd.Stage) -> None:
    if not of.GetPrimAtPath(path):
        to.GetPrimAtPath(path).SetActive(False)
        return
    alone = stage_on(of.GetRootLayer(), of.GetSessionLayer(), only=path)
    flat, session = alone.Flatten(addSourceFileComment=False), to.GetSessionLayer()
    Sdf.CreatePrimInLayer(session, path.GetParentPath())
    Sdf.CopySpec(flat, path, session, path)


def _attribute(path: Sdf.Path, of: Usd.Stage, prim: Usd.Prim) -> None:
    source, own = of.GetAttributeAtPath(path), prim.GetAttribute(path.name)
    if not own:
        own = prim.CreateAttribute(path.name, source.GetTypeName(), source.IsCustom())
    own.Block()
    connections = source.GetConnections() if source else []
    if connections != own.GetConnections():  # an empty list of them would be an opinion too
        own.SetConnections(connections)
    if not source:
        return
    for time in source.GetTimeSamples():
        own.Set(_anywhere(source.Get(Usd.TimeCode(time))), Usd.TimeCode(time))
    if source.HasSpline():
        own.SetSpline(source.GetSpline())
    elif not source.GetTimeSamples() and (value := source.Get()) is not None:
        own.Set(_anywhere(value))


def _anywhere(value: object) -> object:
    """Return the value as a layer without a folder can say it: files by their absolute paths."""
    if isinstance(value, Sdf.AssetPath):
        return Sdf.AssetPath(value.resolvedPath or value.path)
    if isinstance(value, Sdf.AssetPathArray):
        return Sdf.AssetPathArray([Sdf.AssetPath(asset.resolvedPath or asset.path) for asset in value])
    return value

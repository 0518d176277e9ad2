"""The differences between two compositions of a stage, by prim and property: composed values, not opinions.

Documentation, comments and custom data only describe, and are skipped.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd

from spin_usd.records.difference import (
    ACTIVE,
    ATTRIBUTE,
    CONNECTION,
    FILE,
    METADATA,
    PRIM,
    RELATIONSHIP,
    SCHEMAS,
    SELECTION,
    Difference,
)
from spin_usd.stage.composition.opinions import origin, strongest
from spin_usd.stage.composition.stage_hash import asset_sha256, used_files
from spin_usd.stage.usd.visibility import PROXIES

ALL_PRIMS = Usd.TraverseInstanceProxies(Usd.PrimIsDefined & ~Usd.PrimIsAbstract)
"""All prims, also inactive ones."""
WITHOUT_EFFECT = {
    "allowedTokens", "apiSchemas", "active", "comment", "custom", "customData", "default", "displayGroup",
    "displayName", "documentation", "hidden", "specifier", "spline", "timeSamples", "typeName", "variability",
    "variantSelection", "variantSetNames",
}  # fmt: skip

MAX_CHARACTERS = 72  # characters of one value
FIRST = 4  # numbers of an array that are shown
DIGITS = 12  # of a digest


def differences(a: Usd.Stage, b: Usd.Stage) -> Iterator[Difference]:
    """Yield all differences from `a` to `b`, two compositions of one root layer: files first, then by prim path.

    Nothing is listed below a prim that one of them lacks, or that is not active there.
    """
    yield from _files(a, b)
    prims_a, prims_b = ({prim.GetPath(): prim for prim in Usd.PrimRange.Stage(s, ALL_PRIMS)} for s in (a, b))
    clips = any(Usd.ClipsAPI(p).GetClips() for prims in (prims_a, prims_b) for p in prims.values())
    gone = None
    for path in sorted({*prims_a, *prims_b}):
        if gone and path.HasPrefix(gone):
            continue
        before, after = prims_a.get(path), prims_b.get(path)
        if before is None or after is None:
            gone = path
            yield _unmatched(before, after)
        elif clips or before.GetPrimStackWithLayerOffsets() != after.GetPrimStackWithLayerOffsets():
            yield from _prim_differences(before, after)
            gone = None if before.IsActive() and after.IsActive() else path


def _files(a: Usd.Stage, b: Usd.Stage) -> Iterator[Difference]:
    """Yield the files that only one of them uses."""
    folder = a.GetRootLayer().realPath.rpartition("/")[0]
    before, after = used_files(a, folder), used_files(b, folder)
    for file in sorted(before.keys() ^ after.keys()):
        digests = (files[file][:DIGITS] if file in files else None for files in (before, after))
        yield _difference(FILE, file, "", digests, (None, None))


def _unmatched(before: Usd.Prim | None, after: Usd.Prim | None) -> Difference:
    path = next(prim.GetPath() for prim in (before, after) if prim)
    texts = (_described(prim) if prim else None for prim in (before, after))
    return _difference(PRIM, str(path), "", texts, (_origin(prim) if prim else None for prim in (before, after)))


def _described(prim: Usd.Prim) -> str:
    below = sum(1 for _ in Usd.PrimRange(prim, PROXIES)) - 1
    return f"{prim.GetTypeName() or 'prim'}" + (f" and {below} prims below" if below > 0 else "")


def _prim_differences(a: Usd.Prim, b: Usd.Prim) -> Iterator[Difference]:
    where = str(a.GetPath())
    if a.IsActive() != b.IsActive():
        texts = ("active" if prim.IsActive() else "not active" for prim in (a, b))
        yield _difference(ACTIVE, where, "", texts, (_origin(a, "active"), _origin(b, "active")))
        return
    yield from _selections(a, b)
    schemas = [list(map(str, prim.GetPrimTypeInfo().GetAppliedAPISchemas())) for prim in (a, b)]
    if schemas[0] != schemas[1]:
        origins = (_origin(a, "apiSchemas"), _origin(b, "apiSchemas"))
        yield _difference(SCHEMAS, where, "", map(", ".join, schemas), origins)
    yield from _metadata(a, b, where)
    if a.GetTypeName() != b.GetTypeName():
        texts = (str(prim.GetTypeName()) for prim in (a, b))
        yield _difference(METADATA, where, "typeName", texts, (_origin(a, "typeName"), _origin(b, "typeName")))
    names = {p.GetName() for prim in (a, b) for p in prim.GetAuthoredProperties()}
    for name in sorted(names):
        if any(prim.GetRelationship(name) for prim in (a, b)):
            yield from _relationship(a, b, name)
        else:
            yield from _attribute(a, b, name)


def _selections(a: Usd.Prim, b: Usd.Prim) -> Iterator[Difference]:
    """Yield differing variant selections, except those made in the session layer."""
    chosen = [prim.GetVariantSets().GetAllVariantSelections() for prim in (a, b)]
    specs = [prim.GetStage().GetSessionLayer().GetPrimAtPath(prim.GetPath()) for prim in (a, b)]
    asked = {name for spec in specs if spec for name in spec.variantSelections.keys()}  # noqa: SIM118 - a map proxy
    for name in sorted({*chosen[0], *chosen[1]} - asked):
        before, after = (selections.get(name) or None for selections in chosen)
        if before != after:
            origins = (_origin(prim, "variantSelection", name) for prim in (a, b))
            yield _difference(SELECTION, str(a.GetPath()), name, (before, after), origins)


def _metadata(a: Usd.Object, b: Usd.Object, where: str) -> Iterator[Difference]:
    before, after = a.GetAllMetadata(), b.GetAllMetadata()
    for name in sorted(({*before, *after}) - WITHOUT_EFFECT):
        if before.get(name) != after.get(name):
            texts = (str(all_of[name]) if name in all_of else None for all_of in (before, after))
            yield _difference(METADATA, where, name, texts, (None, None))


def _relationship(a: Usd.Prim, b: Usd.Prim, name: str) -> Iterator[Difference]:
    both = [prim.GetRelationship(name) for prim in (a, b)]
    targets = [_paths(r.GetTargets()) if r else None for r in both]
    if targets[0] != targets[1]:
        yield _difference(RELATIONSHIP, f"{a.GetPath()}.{name}", "", targets, map(_property_origin, both))


def _attribute(a: Usd.Prim, b: Usd.Prim, name: str) -> Iterator[Difference]:
    both = [prim.GetAttribute(name) for prim in (a, b)]
    where = f"{a.GetPath()}.{name}"
    connections = [_paths(attribute.GetConnections()) if attribute else None for attribute in both]
    if (connections[0] or None) != (connections[1] or None):
        yield _difference(CONNECTION, where, "", connections, map(_property_origin, both))
    if all(both):
        yield from _metadata(both[0], both[1], where)
    if all(both) and _same_opinions(*both):
        return
    times = sorted({*_times(both[0]), *_times(both[1])})
    codes = [Usd.TimeCode(time) for time in times] or [Usd.TimeCode.Default()]
    differing = [code for code in codes if not same_value(*_values(both, code))]
    if differing:
        either = next(attribute for attribute in both if attribute)
        texts = value_texts(*_values(both, differing[0]), either)
        varies = {"samples": len(differing), "time_code": differing[0].GetValue()} if times else {}
        yield _difference(ATTRIBUTE, where, "", texts, map(_property_origin, both), **varies)


def _same_opinions(a: Usd.Attribute, b: Usd.Attribute) -> bool:
    """Return whether their values come from the same opinions, so that they need not be read."""
    clips = Usd.ResolveInfoSourceValueClips
    if clips in (a.GetResolveInfo().GetSource(), b.GetResolveInfo().GetSource()):
        return False
    return bool(a.GetPropertyStackWithLayerOffsets() == b.GetPropertyStackWithLayerOffsets())


def _times(attribute: Usd.Attribute) -> list[float]:
    if not attribute:
        return []
    return [*attribute.GetTimeSamples(), *(attribute.GetSpline().GetKnots() if attribute.HasSpline() else ())]


def _values(both: list[Usd.Attribute], code: Usd.TimeCode) -> tuple[Any, Any]:
    before, after = (attribute.Get(code) if attribute else None for attribute in both)
    return before, after


def _paths(paths: list[Any]) -> str:
    return ", ".join(f"<{path}>" for path in paths)


def _property_origin(prop: Usd.Property) -> str | None:
    spec = strongest(prop.GetPropertyStack()) if prop else None
    return origin(prop.GetPrim(), spec) if spec else None


def _origin(prim: Usd.Prim, info: str = "specifier", of: str = "") -> str | None:
    """Return the origin of the prim's strongest opinion on `info`; `of`: the variant set of a selection."""
    for spec in prim.GetPrimStack():
        if spec.HasInfo(info) and (not of or of in spec.variantSelections):
            return origin(prim, spec)
    return None


def _difference(kind: str, where: str, name: str, texts: Any, origins: Any, **varies: Any) -> Difference:
    (before, after), (before_from, after_from) = texts, origins
    return Difference(
        kind=kind,
        where=where,
        name=name,
        before=before,
        after=after,
        before_from=before_from,
        after_from=after_from,
        **varies,
    )


def value_texts(a: Any, b: Any, attribute: Usd.Attribute) -> tuple[str | None, str | None]:
    """Return two differing values of `attribute` as text, each in at most MAX_CHARACTERS characters and None for None;
    files with the beginning of their digest, arrays from where they differ if they begin alike."""
    name = str(attribute.GetTypeName().cppTypeName).removeprefix("VtArray<").removesuffix(">")
    single = name == "float" or name[-1:] in "fh"
    first, second = (None if value is None else _text(value, single=single) for value in (a, b))
    if first == second and hasattr(a, "__len__") and len(a) == len(b):
        at = next(i for i, (x, y) in enumerate(zip(a, b, strict=True)) if not same_value(x, y))
        first, second = (f"[at {at}: {_text(v[at], single=single)}, {len(v)} in all]" for v in (a, b))
    return _cut(first), _cut(second)


def _cut(text: str | None) -> str | None:
    return text if text is None or len(text) <= MAX_CHARACTERS else f"{text[: MAX_CHARACTERS - 1]}…"


def same_value(a: Any, b: Any) -> bool:
    """Return whether two values are the same; assets are where they resolve to the same file."""
    if isinstance(a, Sdf.AssetPath) and isinstance(b, Sdf.AssetPath):
        return bool((a.resolvedPath or a.path) == (b.resolvedPath or b.path))
    if isinstance(a, Sdf.AssetPathArray) and isinstance(b, Sdf.AssetPathArray):
        return len(a) == len(b) and all(same_value(x, y) for x, y in zip(a, b, strict=True))
    return bool(a == b)


def _text(value: Any, *, single: bool) -> str:
    match value:
        case bool():
            return str(value).lower()
        case float():
            return str(np.float32(value)) if single else repr(value)
        case str():
            return f'"{value}"'
        case Sdf.AssetPath():
            file = f" {asset_sha256(value.resolvedPath)[:DIGITS]}" if value.resolvedPath else ""
            return f"@{value.path}@{file}"
        case Gf.Quatd() | Gf.Quatf() | Gf.Quath():
            return _text((value.real, *value.imaginary), single=single)
    if not hasattr(value, "__len__"):
        return str(value)
    if type(value).__module__.endswith("Gf") or isinstance(value, tuple):  # matrices have no slices
        return f"({', '.join(_text(item, single=single) for item in value)})"
    first = ", ".join(_text(item, single=single) for item in list(value[:FIRST]))
    return f"[{first}]" if len(value) <= FIRST else f"[{first}, … {len(value)} in all]"

"""The target's prim in a USD file, its dependencies outside it, and the source that a stage was authored from."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdMedia

from spin_usd import __version__
from spin_usd.errors import InputError
from spin_usd.records.descriptions import OriginFile, StageOrigin
from spin_usd.stage.usd import schema

MAX_NAMED = 5  # prims in a sentence

INSTANCE = "author"
# The IPTC's term for an image made by an algorithm without training on samples.
DIGITAL_SOURCE_TYPE = "http://cv.iptc.org/newscodes/digitalsourcetype/algorithmicMedia"


Option = str | int | float | tuple[float, float, float]


def target_root(stage: Usd.Stage, source: Path, prim: str | None) -> Sdf.Path:
    """Return the path of `prim` if given; else of the default prim, or of the only root prim; the absolute root if
    there are several, since usdview and Blender show them all. Raises InputError for a missing prim, and for one
    without geometry."""
    if prim is not None:
        return _given(stage, source, prim)
    if stage.GetDefaultPrim():
        return stage.GetDefaultPrim().GetPath()
    roots = stage.GetPseudoRoot().GetChildren()
    return roots[0].GetPath() if len(roots) == 1 else Sdf.Path.absoluteRootPath


def _given(stage: Usd.Stage, source: Path, prim: str) -> Sdf.Path:
    found = stage.GetPrimAtPath(prim) if Sdf.Path.IsValidPathString(prim) and prim.startswith("/") else None
    if not found or not (found.IsPseudoRoot() or (found.IsActive() and found.IsDefined())):
        names = [str(root.GetPath()) for root in stage.GetPseudoRoot().GetChildren()]
        do = f"choose {_listed(names)}, a prim below, or / for all" if names else "give a file with prims"
        raise InputError(f"has no prim {prim!r}", where=source, do=do)
    if not found.IsPseudoRoot() and not holds_geometry(found):
        raise InputError(f"its prim {prim} holds no geometry", where=source, do="choose one that does, or / for all")
    return found.GetPath()


def outside(stage: Usd.Stage, root: Sdf.Path) -> Iterator[tuple[Usd.Prim, Sdf.Path]]:
    """Yield each prim at and below `root` that is bound to a material or a prototype elsewhere, and the path of that. A
    reference to `root` would lose them, and USD would only warn."""
    for prim in Usd.PrimRange(stage.GetPrimAtPath(root)):
        names = [n for n in prim.GetPropertyNames() if n.startswith("material:binding") or n == "prototypes"]
        for relation in (prim.GetRelationship(name) for name in names):
            for path in relation.GetTargets() if relation else ():
                if not path.HasPrefix(root):
                    yield prim, path


def holds_geometry(root: Usd.Prim) -> bool:
    """Return whether there is geometry at or below `root`, or an instance, which may hold some."""
    return any(
        (prim.IsA(UsdGeom.Gprim) and not prim.IsA(UsdGeom.Points))
        or prim.IsInstance()
        or prim.IsA(UsdGeom.PointInstancer)
        for prim in Usd.PrimRange(root)
    )


def notes_on_root(stage: Usd.Stage, root: Sdf.Path, prim: str | None) -> tuple[str, ...]:
    """Return sentences on which prims became the target, where `prim` was not given, and on its lights."""
    notes = []
    if prim is None and root == Sdf.Path.absoluteRootPath:
        names = [str(each.GetPath()) for each in stage.GetPseudoRoot().GetChildren() if holds_geometry(each)]
        held = f"all {len(names)} root prims with geometry are" if len(names) > 1 else "the root prim with geometry is"
        notes.append(f"no defaultPrim: {held} the target ({_listed(names)}); --prim chooses one")
    own = stage.GetRootLayer().pseudoRoot
    for name in ("metersPerUnit", "upAxis"):
        others = [each for each in stage.GetUsedLayers() if each.pseudoRoot.HasInfo(name) and own.HasInfo(name)]
        differ = [each for each in others if not _is_same(each.pseudoRoot.GetInfo(name), own.GetInfo(name))]
        if differ:
            said = f"{differ[0].GetDisplayName()} has {name} {differ[0].pseudoRoot.GetInfo(name)}"
            notes.append(f"{said}, its root layer {own.GetInfo(name)}: USD converts neither, nor is it done here")
    lights = [each for each in Usd.PrimRange(stage.GetPrimAtPath(root)) if each.HasAPI(UsdLux.LightAPI)]
    if lights:
        named = _listed([str(each.GetPath()) for each in lights])
        count, s, shine = len(lights), "" if len(lights) == 1 else "s", "shines" if len(lights) == 1 else "shine"
        notes.append(f"{count} light{s} of the target's own file {shine} in every picture ({named})")
    return tuple(notes)


def _is_same(one: Any, other: Any) -> bool:
    return bool(one == other or (not isinstance(one, str) and abs(one / other - 1) < 1e-6))


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
    return ", ".join(names[:MAX_NAMED]) + more


@dataclass(frozen=True, kw_only=True)
class Origin:
    """The origin of a stage: the inputs and options from which it was authored."""

    inputs: Mapping[str, tuple[str, str]]
    """Role (poses, target, camera) -> (file or built-in name, sha256)."""
    options: Mapping[str, Option] = field(default_factory=dict)
    """Name (seed, units_per_metre, sun_direction) -> text, a number or three."""


def author_origin(layer: Sdf.Layer, prim: Usd.Prim, origin: Origin) -> None:
    """Record `origin` on a root layer and on its default prim.

    UsdMedia's AuthorshipAPI holds it for other programs, customLayerData for ourselves. No clock is read: the same
    inputs give the same bytes.
    """
    data = dict(layer.customLayerData)
    data[schema.PROVENANCE] = {
        "version": __version__,
        "inputs": {role: {"name": name, "sha256": sha256} for role, (name, sha256) in origin.inputs.items()},
        "options": {name: _as_usd(value) for name, value in origin.options.items()},
    }
    layer.customLayerData = data
    api = UsdMedia.AuthorshipAPI.Apply(prim, INSTANCE)
    api.CreateSoftwarePackageAttr("spin_usd")
    api.CreateSoftwareVersionAttr(__version__)
    api.CreateDigitalSourceTypeAttr(DIGITAL_SOURCE_TYPE)
    pairs = [(f"{role} {name}", f"sha256:{sha256}") for role, (name, sha256) in sorted(origin.inputs.items())]
    api.CreateInputsAttr([text for pair in pairs for text in pair])


def origin_of(stage: Usd.Stage) -> StageOrigin:
    """Return the stage's origin: inputs and options; for a stage that `author` did not make, the name of its root
    layer."""
    for layer in stage.GetLayerStack(includeSessionLayers=False):
        data = layer.customLayerData.get(schema.PROVENANCE)
        inputs, options = ((data.get(name) if isinstance(data, dict) else None) for name in ("inputs", "options"))
        if isinstance(inputs, dict):
            return StageOrigin(
                inputs={role: _file(each) for role, each in inputs.items() if isinstance(each, dict)},
                options={name: _as_json(each) for name, each in (options or {}).items()},
            )
    return StageOrigin(root=Path(stage.GetRootLayer().realPath).name)


def _file(each: Mapping[str, Any]) -> OriginFile:
    return OriginFile(name=str(each.get("name", "")), sha256=str(each.get("sha256", "")))


def _as_usd(option: Option) -> Any:
    return Gf.Vec3d(*option) if isinstance(option, tuple) else option


def _as_json(option: Any) -> Any:
    """Return the option as JSON; as text where `author` does not write its type: a user may have edited it."""
    if isinstance(option, Gf.Vec3d):
        return list(option)
    return option if type(option) in (str, int, float) else str(option)

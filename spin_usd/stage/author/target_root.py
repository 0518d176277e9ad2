"""Find the prim of a USD file that is the target, and what it uses outside itself."""

from collections.abc import Iterator
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom, UsdLux

from spin_usd.errors import InputError

MAX_NAMED = 5  # prims in a sentence


def target_root(stage: Usd.Stage, source: Path, prim: str | None) -> Sdf.Path:
    """Return the path of `prim` where it is given; else of the default prim, or of the only root prim; the absolute
    root where there are several, since usdview and Blender show them all. Raises InputError for a missing prim, and for
    one without geometry."""
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
    lights = [each for each in Usd.PrimRange(stage.GetPrimAtPath(root)) if each.HasAPI(UsdLux.LightAPI)]
    if lights:
        named = _listed([str(each.GetPath()) for each in lights])
        count, s, shine = len(lights), "" if len(lights) == 1 else "s", "shines" if len(lights) == 1 else "shine"
        notes.append(f"{count} light{s} of the target's own file {shine} in every picture ({named})")
    return tuple(notes)


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
    return ", ".join(names[:MAX_NAMED]) + more

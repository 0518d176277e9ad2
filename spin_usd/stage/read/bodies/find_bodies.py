"""Find the bodies of a stage: its targets, and the remaining geometry, which occludes, shades and is reflected."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from pxr import Usd, UsdGeom

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.bodies.renderable import is_geometry
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.prim_order import in_order, ordered_children
from spin_usd.stage.usd.time_variation import POSE
from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import RENDERED_PURPOSES, ancestors, is_always_invisible, own_purpose


@dataclass(frozen=True, kw_only=True, eq=False)
class OccluderPrims:
    """An occluder: all that moves as one in the axes of `frame`."""

    frame: Usd.Prim
    roots: tuple[Usd.Prim, ...]
    """The prims whose subtrees are its geometry, either `frame` itself or children of it."""


def prim_of(body: Usd.Prim | OccluderPrims) -> Usd.Prim:
    """Return the prim in whose axes the body is."""
    return body.frame if isinstance(body, OccluderPrims) else body


def target_name(target: Usd.Prim) -> str:
    """Return the target's name: its attribute, or its prim's name."""
    return str(read(target.GetAttribute(schema.TARGET_NAME)) or target.GetName())


def find_target(stage: Usd.Stage) -> Usd.Prim:
    """Find the first target, whose id is 1. Raises as find_targets."""
    return find_targets(stage)[0]


def find_targets(stage: Usd.Stage) -> tuple[Usd.Prim, ...]:
    """Find the prims with SpinTargetAPI, in the order of their ids. Raises StageError for
    none, and for one below another."""
    found = tuple(in_order(prim for prim in stage.Traverse() if prim.HasAPI(schema.TARGET_API)))
    if not found:
        do = "apply SpinTargetAPI to the prim that holds the spacecraft"
        raise StageError("the stage has no target", where=stage.GetRootLayer().realPath, do=do)
    for prim in found:
        above = next((other for other in ancestors(prim) if other in found), None)
        if above:
            found_there = f"is a target below the target {above.GetPath()}"
            raise StageError(found_there, where=prim.GetPath(), do="remove SpinTargetAPI from one of them")
    return found


def find_occluders(targets: Sequence[Usd.Prim], cameras: Collection[Usd.Prim]) -> tuple[OccluderPrims, ...]:
    """Find the occluders of the stage of `targets` and `cameras`: geometry fixed to its parent belongs to the parent's
    occluder, such as the camera's; moving geometry is its own. Raises UnsupportedError for geometry that contains a
    target or a camera."""
    frames: dict[str, tuple[Usd.Prim, list[Usd.Prim]]] = {}
    for root in occluder_roots(targets, cameras):
        parent = root.GetParent()
        frame = root if parent.IsPseudoRoot() or _moves_below_parent(root) else parent
        frames.setdefault(str(frame.GetPath()), (frame, []))[1].append(root)
    return tuple(OccluderPrims(frame=frame, roots=tuple(roots)) for frame, roots in frames.values())


def occluder_roots(targets: Sequence[Usd.Prim], cameras: Collection[Usd.Prim]) -> Iterator[Usd.Prim]:
    """Yield the topmost prims that hold geometry, rendered at any time, and neither a target nor a camera. Raises
    UnsupportedError for geometry that holds one of these."""
    kept = [prim.GetPath() for prim in (*targets, *cameras)]
    above = {ancestor for path in kept for ancestor in path.GetPrefixes()} - {target.GetPath() for target in targets}
    waiting = [(prim, "default") for prim in _children(targets[0].GetStage().GetPseudoRoot())]
    while waiting:
        prim, inherited = waiting.pop()
        if prim in targets or is_always_invisible(prim):
            continue
        purpose = own_purpose(prim, inherited)
        if prim.GetPath() in above:
            if purpose in RENDERED_PURPOSES and is_geometry(prim):
                do = "move them beside each other"
                raise UnsupportedError("is geometry that holds a target or a camera", where=prim.GetPath(), do=do)
            waiting += [(child, purpose) for child in _children(prim)]
        elif _holds_geometry(prim, purpose):
            yield prim


def _children(prim: Usd.Prim) -> list[Usd.Prim]:
    """List the children in reverse, as a stack takes them."""
    return list(reversed(ordered_children(prim)))


def _holds_geometry(root: Usd.Prim, purpose: str) -> bool:
    """Return whether `root`, of this purpose, contains geometry that is rendered at any time, or refused when it is
    read."""
    waiting = [(root, purpose)]
    while waiting:
        prim, state = waiting.pop()
        try:
            if state in RENDERED_PURPOSES and is_geometry(prim):
                return True
        except UnsupportedError:
            return True
        shown = (child for child in _children(prim) if not is_always_invisible(child))
        waiting += [(child, own_purpose(child, state)) for child in shown]
    return False


def _moves_below_parent(prim: Usd.Prim) -> bool:
    """Return whether the pose of `prim` below its parent can change in time, or does not depend on it."""
    xformable = UsdGeom.Xformable(prim)
    if not xformable:
        return False
    own = (attribute for attribute in prim.GetAuthoredAttributes() if attribute.GetName().startswith(POSE))
    return xformable.GetResetXformStack() or any(attribute.ValueMightBeTimeVarying() for attribute in own)

"""What of a stage can change in time, so that the rest is read once."""

from pxr import Usd

from spin_usd.stage.drawn import ancestors
from spin_usd.stage.keypoints import find_keypoints

POSE = "xformOp:"


def varies_beyond_pose(prim: Usd.Prim) -> bool:
    """Whether an attribute of `prim` but its own pose can change in time."""
    attributes = prim.GetAuthoredAttributes()
    return any(a.ValueMightBeTimeVarying() for a in attributes if not a.GetName().startswith(POSE))


def target_varies(target: Usd.Prim, read: list[Usd.Prim]) -> bool:
    """Whether the target's shape can change in time, its own pose apart. read: the prims that it was read from."""
    if varies_beyond_pose(target) or any(_visibility_varies(prim) for prim in ancestors(target)):
        return True
    return any(_varies(prim) for prim in (*read, *_keypoints_chain(target)) if prim != target)


def _varies(prim: Usd.Prim) -> bool:
    return any(attribute.ValueMightBeTimeVarying() for attribute in prim.GetAuthoredAttributes())


def _visibility_varies(prim: Usd.Prim) -> bool:
    visibility = prim.GetAttribute("visibility")
    return bool(visibility) and bool(visibility.ValueMightBeTimeVarying())


def _keypoints_chain(target: Usd.Prim) -> list[Usd.Prim]:
    """The prim of the keypoints, and all from there up to the target: their poses move the keypoints."""
    keypoints = find_keypoints(target)
    chain = [*ancestors(keypoints), keypoints] if keypoints else []
    return [prim for prim in chain if prim.GetPath().HasPrefix(target.GetPath())]

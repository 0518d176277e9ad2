"""Time variation of a body's shape: a constant one is read once."""

from collections.abc import Sequence

from pxr import Usd

from spin_usd.stage.read.target.keypoints import find_keypoints
from spin_usd.stage.usd.time_variation import has_varying_attribute, varying, visibility_varies
from spin_usd.stage.usd.visibility import ancestors


def target_varies(target: Usd.Prim, read: list[Usd.Prim]) -> bool:
    """Return whether the target's shape can change in time, apart from its own pose. read: the prims that it was read
    from."""
    if varying(target) or any(visibility_varies(prim) for prim in ancestors(target)):
        return True
    return any(has_varying_attribute(prim) for prim in (*read, *_keypoints_chain(target)) if prim != target)


def occluder_varies(frame: Usd.Prim, roots: Sequence[Usd.Prim], read: list[Usd.Prim]) -> bool:
    """Return whether the shape of an occluder with these `roots` can change in the axes of `frame`, which may be one of
    them. read: the prims that it was read from."""
    if any(visibility_varies(prim) for root in roots for prim in ancestors(root)):
        return True
    return any(varying(prim) if prim == frame else has_varying_attribute(prim) for prim in read)


def _keypoints_chain(target: Usd.Prim) -> list[Usd.Prim]:
    """List the prim of the keypoints and all from there up to the target: their poses move the keypoints."""
    keypoints = find_keypoints(target)
    chain = [*ancestors(keypoints), keypoints] if keypoints else []
    return [prim for prim in chain if prim.GetPath().HasPrefix(target.GetPath())]

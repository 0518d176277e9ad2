"""Choose the pictures that are meant by "A:B:STEP", as Python slices them."""

from spin_usd.errors import InputError
from spin_usd.scene.poses import PoseList


def slice_of(text: str) -> slice:
    """Return the Python slice of "A:B" or "A:B:STEP"; any of the three may be missing."""
    fields = text.split(":")
    try:
        if not 2 <= len(fields) <= 3:
            raise ValueError
        numbers = [int(field) if field.strip() else None for field in fields]
    except ValueError:
        raise InputError(f"frames {text!r} is not A:B:STEP", do="write for example 0:100:5") from None
    chosen = slice(*numbers)
    if chosen.step == 0:
        raise InputError(f"frames {text!r} has step 0", do="write for example 0:100:5")
    return chosen


def chosen_frames(poses: PoseList, text: str | None) -> PoseList:
    """Return the poses that `text` (A:B:STEP) chooses; all for None. Raises InputError when it chooses none."""
    if text is None:
        return poses
    chosen = poses[slice_of(text)]
    if not len(chosen):
        raise InputError(f"frames {text!r} chooses none of {len(poses)} poses", where=poses.source or None)
    return chosen

"""How much finer than the picture's pixels those are by which a small target is rendered."""

from math import ceil

from spin_usd.scene.scene import Scene

SMALL_PX = 16.0  # of the target's larger side in the picture: fewer pixels have too few rays for their sum to be right
FINE_PX = 128  # fine pixels of that side
MOST = 8192  # float32 has the fine pixels of a frame of 2,000 apart up to then


def magnification(scene: Scene) -> int:
    """Return how many fine pixels a side of a pixel has; 1 where the target is large enough, or nowhere."""
    box = scene.outline_box
    extent = float((box[1] - box[0]).max()) if box is not None else SMALL_PX
    return 1 if extent >= SMALL_PX else min(ceil(FINE_PX / max(extent, FINE_PX / MOST)), MOST)

"""What lies behind the target, as linear radiance of every pixel: planets, stars, a dome, a back plate."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.model import Scene


def sky(scene: Scene, *, seed: int) -> NDArray[np.float32] | None:
    """(H, W, 3) W/m2/sr, of the whole frame; None where nothing is there but black. `seed` chooses a back plate."""
    return None

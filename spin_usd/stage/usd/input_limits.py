"""What the inputs of materials may be, held against what a stage says."""

import numpy as np

from spin_usd.arrays import Float
from spin_usd.errors import StageError
from spin_usd.scene.material import Limits


def refuse_outside(values: Float, limits: Limits, where: object, source: str = "") -> None:
    """Raise StageError where one of `values`, which `source` gives the input, is none that the input can have."""
    wrong = ~((values >= limits.low) & (values <= limits.high))
    if not wrong.any():
        return
    by = f", by {source}" if source else ""
    do = f"keep it between {limits.low:g} and {limits.high:g}"
    raise StageError(f"its {limits.name} is {np.asarray(values)[wrong][0]:g}{by}", where=where, do=do)

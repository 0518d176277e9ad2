"""Array attributes of prims as numpy arrays, and the refusal of what they must not hold."""

from typing import Any

import numpy as np
from pxr import Usd

from spin_usd.errors import StageError


def array(attribute: Usd.Attribute, time: Usd.TimeCode, dtype: type) -> Any:
    """The value at `time`; empty where there is none."""
    value = attribute.Get(time)
    return np.zeros(0, dtype) if value is None else np.array(value, dtype)


def refuse(bad: Any, name: str, values: Any, why: str, where: Any) -> None:
    """Raise StageError for the first of `values` (N, ...) that is `bad` (N,)."""
    if bad.any():
        i = int(np.argmax(bad))
        raise StageError(f"{name}[{i}] is {values[i]}, but {why}", where=where, do="fix the mesh")

"""Read-only arrays, checked at the door, and their content digests."""

import hashlib
import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from spin_usd.errors import GeometryError

Float = NDArray[np.float64]
_JSON = json.JSONEncoder(sort_keys=True, separators=(",", ":"), allow_nan=False)


def frozen(values: ArrayLike, dtype: DTypeLike = np.float64) -> NDArray[Any]:
    """Return `values` as a C-contiguous read-only array that no other code can write to; copies only if necessary."""
    array = np.asarray(values, dtype=dtype, order="C")
    if array.flags.writeable:
        if isinstance(values, np.ndarray) and np.may_share_memory(array, values):
            array = array.copy()
        array.flags.writeable = False
    return array


def finite(values: ArrayLike, shape: Sequence[int | None], name: str) -> Float:
    """Return `values` as a frozen float64 array of `shape` (None = any length); NaN and infinity are refused."""
    array = shaped(values, shape, name)
    if not np.isfinite(array).all():
        raise GeometryError(f"{name} holds NaN or infinity")
    return array


def shaped(values: ArrayLike, shape: Sequence[int | None], name: str) -> Float:
    """Return `values` as a frozen float64 array of `shape` (None = any length)."""
    array = np.asarray(values, dtype=np.float64)
    fits = array.shape == shape or (
        array.ndim == len(shape)
        and all(want is None or want == have for want, have in zip(shape, array.shape, strict=True))
    )
    if not fits:
        raise GeometryError(f"{name} has shape {array.shape}, expected {tuple(shape)}")
    return frozen(array)


def digest(*items: Any) -> str:
    """sha256 (hex) of arrays (type, shape, bytes) and JSON values, in order; stable across machines.

    The digest of several items differs from the digest of any other split of the same bytes.
    """
    total = hashlib.sha256()
    for item in items:
        if isinstance(item, np.ndarray):
            little = item.astype(item.dtype.newbyteorder("<"), order="C", copy=False)
            head = f"{little.dtype.str}{item.shape}".encode()
            body: bytes | memoryview = little.tobytes()
        else:
            head = b"json"
            body = _JSON.encode(item).encode()
        total.update(len(head).to_bytes(8, "little") + head + len(body).to_bytes(8, "little"))
        total.update(body)
    return total.hexdigest()

"""The numbers in a file of a picture, checked against its label: a record may state anything."""

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from spin_usd.errors import InputError
from spin_usd.files.folder import FileIn
from spin_usd.formats.array_file import described_type, read_array
from spin_usd.labels.table import CLOUD_LABELS, LABELS


def read_picture_file(
    file: FileIn, kind: str, dtype: str | Mapping[str, str], channels: int, rows: range | None = None
) -> NDArray[Any]:
    """Read the numbers of a file of that kind: (H, W) or (H, W, C) pixels, only these `rows`, or (N,) points of a
    LiDAR.

    Raises InputError if they do not have the type and the channels of the label of that name. Any other kind is an
    image, with the `dtype` and `channels` of its record.
    """
    if kind in LABELS:
        dtype, channels = LABELS[kind].channels.dtype, len(LABELS[kind].channels.holds)
    array = read_array(file, rows)
    shape = array.shape[:1] if kind in CLOUD_LABELS else (*array.shape[:2], channels)[: 2 if channels == 1 else 3]
    if described_type(array) != dtype or array.shape != shape:
        found = f"holds {array.dtype} numbers in {array.shape}, which are not those of {kind}"
        raise InputError(found, where=file.path, do="run spin-usd check on the dataset")
    return array

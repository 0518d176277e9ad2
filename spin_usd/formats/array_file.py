"""The files of a picture, whatever they hold: images, and the points of a LiDAR.

Point clouds are NPZ and PLY: an array with named columns, whose numbers come back as they were written. Equal
clouds are equal bytes: NPZ is not compressed, for compressors differ, and has no times. PLY is binary, little endian; a
column of three numbers called `points` is its x, y and z. Sources: PKWARE's APPNOTE 6.3.10 on zip; numpy's NEP 1 on
npy; G. Turk, "The PLY polygon file format" (1994).
"""

import zipfile
from collections.abc import Callable, Mapping
from io import BufferedReader, BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.folder import FileIn
from spin_usd.files.size_limits import MAX_ARRAY
from spin_usd.files.user_file import open_file
from spin_usd.formats.image_file import decoded_image, encoded_image
from spin_usd.scene.channels import Channels

Cloud = NDArray[np.void]

FIRST_TIME = (1980, 1, 1, 0, 0, 0)  # of a zip file
POSITION, AXES = "points", ("x", "y", "z")
PLY_TYPES = {"float32": "float", "float64": "double", "uint8": "uchar", "uint16": "ushort", "uint32": "uint"}
NUMPY_TYPES = {name: np.dtype(dtype).newbyteorder("<") for dtype, name in PLY_TYPES.items()}
END = b"end_header\n"


def encoded_array(array: NDArray[Any], suffix: str, *, kind: str, channels: Channels) -> bytes:
    """Return the bytes of a file of that `kind` and suffix with the `array`, an image (H, W) or (H, W, C) or a table
    (N,). Raises as encoded_image does."""
    if suffix in SUFFIXES:
        return encoded_point_cloud(array, suffix, header=channels.header(kind))
    return encoded_image(array, suffix, channels=channels.names, header=channels.header(kind))


def read_array(source: FileIn, rows: range | None = None) -> NDArray[Any]:
    """Read the numbers in a file that `encoded_array` made; of an image these `rows` alone. Raises InputError."""
    with source.folder.open(source.name, MAX_ARRAY) as file:
        path = source.path
        return decoded_point_cloud(file, path) if path.suffix in SUFFIXES else decoded_image(file, path, rows)[0]


def described_type(array: NDArray[Any]) -> str | dict[str, str]:
    """Return the type of the numbers as numpy names it; of a table each column's, by its name."""
    names = array.dtype.names
    return array.dtype.name if names is None else {name: array.dtype[name].base.name for name in names}


def encoded_point_cloud(cloud: Cloud, suffix: str, *, header: Mapping[str, str]) -> bytes:
    """Return the bytes of a .npz or .ply with the `cloud` (N,), whose columns are numbers or threes of them; only .ply
    keeps the `header`, as comments."""
    return _ENCODERS[suffix](cloud, header)


def read_point_cloud(path: Path) -> Cloud:
    """Read the cloud (N,) in a .npz or .ply that `encoded_point_cloud` made. Raises InputError."""
    with open_file(path, MAX_ARRAY) as file:
        return decoded_point_cloud(file, path)


def decoded_point_cloud(file: BufferedReader, path: Path) -> Cloud:
    """Return the cloud in a `file` that is open already and lies at `path`. Raises InputError."""
    try:
        with decoding(path):
            return _READERS[path.suffix](file)
    except InputError as e:
        raise InputError(e.found, where=path, do="make it again") from e


def _npz(cloud: Cloud, header: Mapping[str, str]) -> bytes:
    data = BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_STORED) as archive:
        for name in cloud.dtype.names or ():
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=FIRST_TIME)
            entry.create_system, entry.external_attr = 3, 0o600 << 16  # whatever the system is
            with archive.open(entry, "w") as file:
                np.lib.format.write_array(file, np.ascontiguousarray(cloud[name]), version=(1, 0))
    return data.getvalue()


def _read_npz(file: BufferedReader) -> Cloud:
    with np.load(file, allow_pickle=False) as archive:
        columns = {name: archive[name] for name in archive.files}
    return _cloud(columns)


def _ply(cloud: Cloud, header: Mapping[str, str]) -> bytes:
    lines = ["ply", "format binary_little_endian 1.0"]
    lines += [f"comment {name}: {' '.join(text.split())}" for name, text in header.items()]
    lines += [f"element vertex {len(cloud)}"]
    for name in cloud.dtype.names or ():
        of = PLY_TYPES[cloud.dtype[name].base.name]
        lines += [f"property {of} {each}" for each in (AXES if name == POSITION else (name,))]
    return "".join(f"{line}\n" for line in lines).encode() + END + cloud.tobytes()


def _read_ply(file: BufferedReader) -> Cloud:
    head, _, body = file.read().partition(END)
    words = [line.split() for line in head.decode().splitlines()]
    if words[:2] != [["ply"], ["format", "binary_little_endian", "1.0"]]:
        raise ValueError("its head is not a binary PLY's")
    (count,) = (int(line[2]) for line in words if line[:2] == ["element", "vertex"])
    fields: list[Any] = [(line[2], NUMPY_TYPES[line[1]]) for line in words if line[:1] == ["property"]]
    if [name for name, _ in fields[:3]] == list(AXES):
        fields[:3] = [(POSITION, fields[0][1], (3,))]
    dtype = np.dtype(fields)
    if len(body) != count * dtype.itemsize:
        raise ValueError(f"it holds {len(body)} bytes of {count * dtype.itemsize}")
    return np.frombuffer(body, dtype).copy()


def _cloud(columns: Mapping[str, NDArray[Any]]) -> Cloud:
    """Return the columns as one array."""
    (count,) = {len(column) for column in columns.values()}
    fields: list[Any] = [(name, column.dtype, column.shape[1:]) for name, column in columns.items()]
    if any(column.shape[1:] != ((3,) if name == POSITION else ()) for name, column in columns.items()):
        raise ValueError("its columns have other shapes")
    cloud = np.zeros(count, np.dtype(fields))
    for name, column in columns.items():
        cloud[name] = column
    return cloud


_ENCODERS: Mapping[str, Callable[[Cloud, Mapping[str, str]], bytes]] = {".npz": _npz, ".ply": _ply}
_READERS: Mapping[str, Callable[[BufferedReader], Cloud]] = {".npz": _read_npz, ".ply": _read_ply}
SUFFIXES = tuple(_ENCODERS)
"""Of the files that are point clouds."""

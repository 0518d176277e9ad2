"""The files of a picture, whatever they hold: images, and the points of a LiDAR."""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from spin_usd.files.folder import FileIn
from spin_usd.files.size_limits import MAX_ARRAY
from spin_usd.formats.arrays.image_file import decoded_image, write_image
from spin_usd.formats.arrays.point_cloud_file import SUFFIXES, decoded_point_cloud, write_point_cloud
from spin_usd.scene.channels import Channels


def write_array(path: Path, array: NDArray[Any], *, kind: str, channels: Channels) -> None:
    """Write the `array`, an image (H, W) or (H, W, C) or a table (N,), as a file of that `kind`. Raises as write_image
    and write_point_cloud do."""
    if path.suffix in SUFFIXES:
        write_point_cloud(path, array, header=channels.header(kind))
    else:
        write_image(path, array, channels=channels.names, header=channels.header(kind))


def read_array(source: FileIn, rows: range | None = None) -> NDArray[Any]:
    """Read the numbers in a file that `write_array` wrote; of an image these `rows` alone. Raises InputError."""
    with source.folder.open(source.name, MAX_ARRAY) as file:
        path = source.path
        return decoded_point_cloud(file, path) if path.suffix in SUFFIXES else decoded_image(file, path, rows)[0]


def described_type(array: NDArray[Any]) -> str | dict[str, str]:
    """Return the type of the numbers as numpy names it; of a table each column's, by its name."""
    names = array.dtype.names
    return array.dtype.name if names is None else {name: array.dtype[name].base.name for name in names}

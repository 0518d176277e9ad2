"""Image files through OpenImageIO: every number comes back as it was written, and equal images are equal bytes.

OpenImageIO's traps, and what is done about them: names like "uint16" silently mean half in EXR (only its own type
constants are used); EXR carries the time of writing (set to a constant); `write_image` and `close` report success on
a full disk (each file is decoded again and compared), and for JPEG the process ends there (Pillow writes those).
"""

from collections.abc import Mapping
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio  # noqa: N813  the name its own documentation uses
from numpy.typing import NDArray
from PIL import Image as PillowImage

from spin_usd.errors import InputError, OutputError, UnsupportedError
from spin_usd.files.given_file import open_file, path_of
from spin_usd.files.size_limits import MAX_ARRAY

Image = NDArray[Any]

KINDS = {".exr": ("float32",), ".png": ("uint8", "uint16"), ".jpg": ("uint8",)}
TYPES = {"float32": oiio.FLOAT, "uint8": oiio.UINT8, "uint16": oiio.UINT16}
ATTRIBUTES: dict[str, dict[str, str | int]] = {
    ".exr": {"compression": "zip"},
    # Measured on labels and noisy pictures: level 4 without row filters (libpng's PNG_FILTER_NONE, 8) is both faster
    # and smaller than with them, and twice as fast as OpenImageIO's default.
    ".png": {"png:compressionLevel": 4, "png:filter": 8},
}
CONSTANTS = {"DateTime": "2000:01:01 00:00:00", "Software": "spin_usd"}
JPEG_QUALITY = 95
JPEG_MEAN_ERROR = 4.0  # grey levels; quality 95 leaves 3.2 of pure colour noise, less of pictures

oiio.attribute("threads", 1)  # a worker has one processor
oiio.attribute("exr_threads", -1)  # and OpenEXR's pool would start threads even for one: -1 is none


def write_image(
    path: Path, array: Image, *, channels: tuple[str, ...], header: Mapping[str, str] | None = None
) -> None:
    """Write `array`, (H, W) or (H, W, C), with one name for each channel, and decode it again.

    .exr holds float32, .png uint8 or uint16, .jpg uint8 (lossy). Only .exr keeps the names, and `header`: attributes by
    name, such as "spin:unit"; the others have 1 or 3 channels. Raises UnsupportedError for another kind, OutputError
    when the file did not come out whole.
    """
    pixels = np.ascontiguousarray(array[..., None] if array.ndim == 2 else array)
    _check_kind(path, pixels, channels)
    if path.suffix == ".jpg":
        _write_jpeg(path, pixels)
    else:
        _write(path, pixels, channels, header or {})
    _check_written(path, pixels, channels)


def _write(path: Path, pixels: Image, channels: tuple[str, ...], header: Mapping[str, str]) -> None:
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], TYPES[pixels.dtype.name])
    attributes = {**ATTRIBUTES[path.suffix], **CONSTANTS}
    if path.suffix == ".exr":
        spec.channelnames = channels
        attributes |= header
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    if output is None or not output.open(str(path), spec):
        raise OutputError(f"cannot be written ({_error(output)})", where=path, do="choose another folder")
    written = output.write_image(pixels)
    if not (output.close() and written):
        raise OutputError(f"cannot be written whole ({_error(output)})", where=path, do="free some space")


def _write_jpeg(path: Path, pixels: Image) -> None:
    try:
        PillowImage.fromarray(pixels.squeeze(-1) if pixels.shape[2] == 1 else pixels).save(
            path, quality=JPEG_QUALITY, subsampling=0
        )
    except OSError as e:
        raise OutputError(f"cannot be written ({e.strerror or e})", where=path, do="free some space") from e


def read_image(path: Path) -> tuple[Image, tuple[str, ...]]:
    """Read the image (H, W), or (H, W, C) when it has several channels, in the file's own number type, and their names.

    Channels come in the order of their names, R, G, B (and A) before all others. Raises InputError.
    """
    with open_file(path, MAX_ARRAY) as file:
        return decoded_image(file, path)


def decoded_image(file: BufferedReader, path: Path) -> tuple[Image, tuple[str, ...]]:
    """Return what `read_image` does, of a `file` that is open already and lies at `path`. Raises InputError."""
    source = oiio.ImageInput.open(path_of(file))
    if source is None:
        raise InputError(f"cannot be read as an image ({_error(None)})", where=path, do="make it again")
    spec = source.spec()
    pixels = source.read_image(0, 0, 0, spec.nchannels, spec.format)
    source.close()
    if pixels is None:
        raise InputError(f"is cut short or damaged ({_error(source)})", where=path, do="make it again")
    return _in_name_order(pixels.reshape(spec.height, spec.width, spec.nchannels), list(spec.channelnames))


def _in_name_order(pixels: Image, names: list[str]) -> tuple[Image, tuple[str, ...]]:
    first = [names.index(name) for name in "RGBA" if name in names]
    others = sorted((i for i in range(len(names)) if i not in first), key=names.__getitem__)
    order = first + others
    if order != list(range(len(names))):
        pixels = np.ascontiguousarray(pixels[..., order])
    return pixels[..., 0] if len(names) == 1 else pixels, tuple(names[i] for i in order)


def _check_kind(path: Path, pixels: Image, channels: tuple[str, ...]) -> None:
    types = KINDS.get(path.suffix)
    if types is None:
        raise UnsupportedError(f"cannot write {path.suffix!r} files", where=path, do=f"choose {', '.join(KINDS)}")
    if pixels.dtype.name not in types:
        raise UnsupportedError(f"{path.suffix} cannot hold {pixels.dtype}", where=path, do=f"give {' or '.join(types)}")
    if pixels.ndim != 3 or pixels.shape[2] != len(channels):
        raise UnsupportedError(f"array {pixels.shape} does not have the channels {channels}", where=path)
    if path.suffix != ".exr" and len(channels) not in (1, 3):
        raise UnsupportedError(f"{path.suffix} cannot hold {len(channels)} channels", where=path, do="give 1 or 3")


def _check_written(path: Path, pixels: Image, channels: tuple[str, ...]) -> None:
    """Decode the file again; every bit must be there, or for JPEG the picture."""
    try:
        found, names = read_image(path)
    except InputError as e:
        raise OutputError(f"was written, but {e.found}", where=path, do="free some space and try again") from e
    wanted, expected = _in_name_order(pixels, list(channels))
    same = found.shape == wanted.shape and found.dtype == wanted.dtype
    if same and path.suffix == ".jpg":
        same = float(np.abs(found.astype(np.int16) - wanted).mean()) <= JPEG_MEAN_ERROR
    elif same:
        bits = f"u{wanted.itemsize}"  # not as floats: NaN and minus zero must come back too
        same = bool(np.array_equal(found.view(bits), wanted.view(bits)))
    if not same or (path.suffix == ".exr" and names != expected):
        raise OutputError("came back different from what was written", where=path, do="check the disk and try again")


def _error(source: Any) -> str:
    return (source.geterror() if source is not None else oiio.geterror()) or "no reason given"

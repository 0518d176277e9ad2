"""Image files through OpenImageIO: numbers are read back exactly as written, and equal images give equal bytes.

OpenImageIO's traps, and our measures: names like "uint16" silently mean half in EXR (only its own type constants are
used); EXR carries the time of writing (set to a constant); `write_image` and `close` report success on a full disk (so
it writes into memory, and we to the disk), and end the process over a JPEG (Pillow encodes those).
"""

import math
import struct
from collections.abc import Mapping
from contextlib import suppress
from io import BufferedReader, BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio  # noqa: N813  the name its own documentation uses
from numpy.typing import NDArray
from PIL import Image as PillowImage

from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError, OutputError, SpinError, UnsupportedError
from spin_usd.files.new_file import memory_file, write_whole
from spin_usd.files.size_limits import MAX_ARRAY
from spin_usd.files.user_file import open_file, path_of

Image = NDArray[Any]

ENDINGS = {".exr": ("float32",), ".png": ("uint8", "uint16"), ".jpg": ("uint8",)}
TYPES = {"float32": oiio.FLOAT, "uint8": oiio.UINT8, "uint16": oiio.UINT16}
ATTRIBUTES: dict[str, dict[str, str | int]] = {
    ".exr": {"compression": "zip"},
    # Measured on labels and noisy pictures: level 4 without row filters (libpng's PNG_FILTER_NONE, 8) is both faster
    # and smaller than with them, and twice as fast as OpenImageIO's default.
    ".png": {"png:compressionLevel": 4, "png:filter": 8},
}
CONSTANTS = {"DateTime": "2000:01:01 00:00:00", "Software": "spin_usd"}
JPEG_QUALITY = 95

oiio.attribute("threads", 1)  # a worker has one processor
oiio.attribute("exr_threads", -1)  # and OpenEXR's pool would start threads even for one: -1 starts none
END_OF_JPEG = b"\xff\xd9"
JPEG_PADDING = 4096  # bytes that some cameras write after the end of a JPEG
PNG_HEAD = EXR_HEAD = 8  # bytes
PNG_FRAME = 12  # bytes of a chunk beside its data: length, type and checksum
EXR_ROWS = 16  # of a chunk that is compressed by ZIP


def write_image(
    path: Path, array: Image, *, channels: tuple[str, ...], header: Mapping[str, str] | None = None
) -> None:
    """Write the result of `encoded_image`. Raises its errors, and OutputError if the file is incomplete."""
    try:
        write_whole(path, encoded_image(array, path.suffix, channels=channels, header=header))
    except SpinError as e:
        raise type(e)(e.found, where=path, do=e.do) from e
    except OSError as e:
        raise OutputError(f"cannot be written ({e.strerror})", where=path, do="free some space") from e


def encoded_image(
    array: Image,
    suffix: str,
    *,
    channels: tuple[str, ...],
    header: Mapping[str, str] | None = None,
    quality: int = JPEG_QUALITY,
) -> bytes:
    """Return the bytes of an image file of that `suffix` with `array`, (H, W) or (H, W, C), and one name for each
    channel.

    .exr holds float32, .png uint8 or uint16, .jpg uint8 (lossy, of that `quality`). Only .exr keeps the names, and
    `header`: attributes by name, such as "spin:unit"; the others have 1 or 3 channels. Raises UnsupportedError for
    another kind, OutputError where memory does not hold the bytes.
    """
    pixels = np.ascontiguousarray(array[..., None] if array.ndim == 2 else array)
    _check_kind(suffix, pixels, channels)
    if suffix == ".jpg":
        return _jpeg(pixels, quality)
    return _encoded(suffix, pixels, _spec(suffix, pixels, channels, header or {}))


def _encoded(suffix: str, pixels: Image, spec: Any) -> bytes:
    """Return the bytes of a PNG or an EXR. Raises OutputError where memory does not hold them."""
    with memory_file() as file:
        output = oiio.ImageOutput.create(suffix[1:])
        assert output  # it has both formats
        written = output.open(file.path, spec) and output.write_image(pixels)
        written = output.close() and written
        data = file.data()
    whole = png_is_whole(data) if suffix == ".png" else exr_is_whole(data, rows=len(pixels))
    if not (written and whole):
        found = f"does not fit into memory, or a file's largest size ({_error(output)})"
        raise OutputError(found, do="free some memory, or raise the limit (ulimit -f)")
    return data


def _spec(suffix: str, pixels: Image, channels: tuple[str, ...], header: Mapping[str, str]) -> Any:
    """Return OpenImageIO's description of the file."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], TYPES[pixels.dtype.name])
    attributes = {**ATTRIBUTES[suffix], **CONSTANTS}
    if suffix == ".exr":
        spec.channelnames = channels
        attributes |= header
    for name, value in attributes.items():
        spec.attribute(name, value)
    return spec


def _jpeg(pixels: Image, quality: int) -> bytes:
    """Return the bytes of a JPEG."""
    file = BytesIO()
    image = PillowImage.fromarray(pixels.squeeze(-1) if pixels.shape[2] == 1 else pixels)
    image.save(file, "jpeg", quality=quality, subsampling=0)
    return file.getvalue()


def read_image(path: Path) -> tuple[Image, tuple[str, ...]]:
    """Read the image (H, W), or (H, W, C) when it has several channels, in the file's own number type, and their names.

    Channels come in the order of their names, R, G, B (and A) before all others. Raises InputError.
    """
    with open_file(path, MAX_ARRAY) as file:
        return decoded_image(file, path)


def decoded_image(file: BufferedReader, path: Path, rows: range | None = None) -> tuple[Image, tuple[str, ...]]:
    """Return the result of `read_image` for an open `file` at `path`: all of it, or only these `rows`, at a
    proportional cost. Raises InputError."""
    with decoding(path):
        source = oiio.ImageInput.open(path_of(file))
        if source is None:
            raise InputError(f"cannot be read as an image ({_error(None)})", where=path, do="make it again")
        spec = source.spec()
        if rows is None:
            pixels = source.read_image(0, 0, 0, spec.nchannels, spec.format)
        else:
            first, last = (spec.y + min(row, spec.height) for row in (rows.start, rows.stop))
            pixels = source.read_scanlines(0, 0, first, last, 0, 0, spec.nchannels, spec.format)
        source.close()
    if pixels is None:
        raise InputError(f"is cut short or damaged ({_error(source)})", where=path, do="make it again")
    return _in_name_order(pixels.reshape(-1, spec.width, spec.nchannels), list(spec.channelnames))


def image_size(path: Path) -> tuple[int, int] | None:
    """Return width and height by the head of an image file; None if it has none."""
    with suppress(SpinError), open_file(path, MAX_ARRAY) as file, decoding(path), PillowImage.open(file) as image:
        return image.size
    return None


def resampled(image: Image, box: tuple[float, float, float, float], size: tuple[int, int]) -> Image:
    """Return the `box` x0, y0, x1, y1 of the one channel `image` (H, W) float32 in the `size` (width, height).

    Coordinates have (0, 0) at the image's corner. Each pixel is a mean of those around its centre, weighted by a
    triangle as wide as two pixels, of the image or of the result, whichever are wider: "bilinear with antialiasing".
    """
    return np.asarray(PillowImage.fromarray(image).resize(size, PillowImage.Resampling.BILINEAR, box))


def _in_name_order(pixels: Image, names: list[str]) -> tuple[Image, tuple[str, ...]]:
    first = [names.index(name) for name in "RGBA" if name in names]
    others = sorted((i for i in range(len(names)) if i not in first), key=names.__getitem__)
    order = first + others
    if order != list(range(len(names))):
        pixels = np.ascontiguousarray(pixels[..., order])
    return pixels[..., 0] if len(names) == 1 else pixels, tuple(names[i] for i in order)


def _check_kind(suffix: str, pixels: Image, channels: tuple[str, ...]) -> None:
    types = ENDINGS.get(suffix)
    if types is None:
        raise UnsupportedError(f"cannot write {suffix!r} files", do=f"choose {', '.join(ENDINGS)}")
    if pixels.dtype.name not in types:
        raise UnsupportedError(f"{suffix} cannot hold {pixels.dtype}", do=f"give {' or '.join(types)}")
    if pixels.ndim != 3 or pixels.shape[2] != len(channels):
        raise UnsupportedError(f"array {pixels.shape} does not have the channels {channels}")
    if suffix != ".exr" and len(channels) not in (1, 3):
        raise UnsupportedError(f"{suffix} cannot hold {len(channels)} channels", do="give 1 or 3")


def _error(source: Any) -> str:
    return (source.geterror() if source is not None else oiio.geterror()) or "no reason given"


def jpeg_is_whole(data: bytes) -> bool:
    """Return whether the JPEG ends as it must; decoders fill what is missing with grey."""
    return END_OF_JPEG in data[-JPEG_PADDING:]


def png_is_whole(data: bytes) -> bool:
    """Return whether the chunks of a PNG follow one another up to its last byte. If written bytes were lost, later
    chunks lie nearer to the start. Source: the PNG specification (W3C)."""
    place: int = PNG_HEAD
    while place + PNG_FRAME <= len(data):
        size, kind = struct.unpack_from(">I4s", data, place)
        place += size + PNG_FRAME
        if kind == b"IEND":
            return place == len(data)
    return False


def exr_is_whole(data: bytes, *, rows: int) -> bool:
    """Return whether the chunks of an EXR of `rows` rows, compressed by ZIP, lie where its table says, up to its last
    byte. Source: "OpenEXR File Layout", files of scan lines."""
    try:
        place = _after_header(data)
        table = struct.unpack_from(f"<{math.ceil(rows / EXR_ROWS)}Q", data, place)
        place += 8 * len(table)
        for start in table:
            if start != place:
                return False
            place += 8 + struct.unpack_from("<I", data, place + 4)[0]
    except (struct.error, ValueError, IndexError):
        return False
    return place == len(data)


def _after_header(data: bytes) -> int:
    """Return where the table begins: behind attributes, each a name, a type, a size and a value."""
    place = EXR_HEAD
    while data[place]:
        for _ in ("name", "type"):
            place = data.index(0, place) + 1
        place += 4 + struct.unpack_from("<I", data, place)[0]
    return place + 1

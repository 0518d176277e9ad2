"""The image files that a model names or holds, as bytes to be written beside it.

PNG, JPEG and EXR pass unchanged; BMP, TGA, TIFF, WebP, GIF and PPM, which few readers of USD know, are rewritten as PNG
without loss.
"""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image, ImageChops

from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_TEXTURE
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.referenced_file import file_within
from spin_usd.scene.asset import RAW, SRGB, ImageFile

EXR, EXR_MAGIC = ".exr", b"v/1\x01"
UNCHANGED = {"PNG": ".png", "JPEG": ".jpg"}
REWRITTEN = ("BMP", "TGA", "TIFF", "WEBP", "GIF", "PPM")
EIGHT_BITS = ("1", "L", "LA", "P", "RGB", "RGBA")
BAND = 256  # rows looked at together
MAX_PIXELS = 2**26  # the limit of a stage's reader: 8192 x 8192


def texture_beside(file: Path, named: str, folder: Path) -> ImageFile:
    """Return the image that `file`, the model or one of its libraries, names by a path relative to itself.

    Raises InputError for a file that is missing, is not an image, or lies outside `folder`, the model's.
    """
    full = file_within(folder, file.parent, named)
    if full is None:
        raise InputError(f"the texture {named!r} lies outside the model's folder (--root FOLDER takes it)")
    if not full.exists():
        raise InputError(f"the texture {named!r} is missing")
    try:
        data = read_bytes(full, MAX_TEXTURE)
    except InputError as error:
        raise InputError(f"the texture {named!r} {error.found}") from None
    return texture_of(full.name, data)


def texture_of(name: str, data: bytes) -> ImageFile:
    """Return the image in `data`, decoded once to be sure of it; its name gets the suffix of its true format."""
    stem = name[: -len(suffix)] if (suffix := Path(name).suffix) else name
    if data.startswith(EXR_MAGIC):
        return ImageFile(name=stem + EXR, data=data)
    image = _decoded(name, data)
    if image.format in UNCHANGED:
        return ImageFile(name=stem + UNCHANGED[image.format], data=data)
    if image.mode not in EIGHT_BITS:
        raise InputError(f"the texture {name!r} is {image.format} of kind {image.mode}; make it PNG or EXR")
    png = io.BytesIO()
    image.save(png, "PNG")
    return ImageFile(name=f"{stem}.png", data=png.getvalue())


def color_space(file: ImageFile) -> str:
    """Return the colour space of such a file: EXR is linear."""
    return RAW if file.name.endswith(EXR) else SRGB


def has_alpha(file: ImageFile) -> bool:
    """Return whether the image has a channel of opacity; False for EXR, where it is not examined."""
    if file.name.endswith(EXR):
        return False
    image = _opened(file.name, file.data)
    return "A" in image.getbands() or "transparency" in image.info


def is_grey(file: ImageFile) -> bool:
    """Return whether red, green and blue are the same all over; False for EXR, where it is not examined."""
    if file.name.endswith(EXR):
        return False
    image = _decoded(file.name, file.data)
    if image.mode in ("1", "L", "LA", "I", "I;16", "F"):
        return True
    bands = (image.crop((0, top, image.width, min(top + BAND, image.height))) for top in range(0, image.height, BAND))
    return all(_is_grey(band.convert("RGB")) for band in bands)


def _is_grey(rgb: Image.Image) -> bool:
    red, green, blue = rgb.split()
    return not (ImageChops.difference(red, green).getbbox() or ImageChops.difference(red, blue).getbbox())


def _decoded(name: str, data: bytes) -> Image.Image:
    image = _opened(name, data)
    with _refusing(name):
        image.load()
    return image


def _opened(name: str, data: bytes) -> Image.Image:
    """Read the image's header. Raises InputError."""
    with decoding(name), _refusing(name):
        image = Image.open(io.BytesIO(data), formats=[*UNCHANGED, *REWRITTEN])
    if image.width * image.height > MAX_PIXELS:
        raise InputError(f"the texture {name!r} has {image.width} x {image.height} pixels, more than {MAX_PIXELS}")
    return image


@contextmanager
def _refusing(name: str) -> Iterator[None]:
    """Raise InputError for a file that is not an image, or is damaged."""
    try:
        with decoding(name):
            yield
    except InputError as error:
        reason = str(error.__cause__ or error.found).split(" <")[0]
        raise InputError(
            f"the texture {name!r} is not a PNG, JPEG, EXR, BMP, TGA, TIFF, WebP, GIF or PPM image ({reason})"
        ) from None

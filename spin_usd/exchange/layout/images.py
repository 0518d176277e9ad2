"""Images and masks in the forms that formats take: linked where the dataset has that form, else made."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.exchange.layout.export_format import FormatOption, LinkedFile, MadeFile
from spin_usd.exchange.layout.exported_dataset import ExportedPicture
from spin_usd.exchange.layout.limits import UINT16_MAX
from spin_usd.exchange.layout.models import MILLIMETRES
from spin_usd.exchange.layout.rectified_picture import NO, YES
from spin_usd.formats.image_file import JPEG_QUALITY, write_image

LUMA = (0.2126, 0.7152, 0.0722)  # Rec. 709, of the encoded numbers
GREY = "grey = 0.2126 R + 0.7152 G + 0.0722 B of the encoded numbers"
JPEG = f"JPEG of quality {JPEG_QUALITY}, without chroma subsampling"
GREY_JPEG = f"Images are grey, 8 bits, {JPEG} ({GREY}); a dataset's files in this form are unchanged."
VISIBLE = 255
RGB = FormatOption(
    name="rgb",
    meaning="whether grey images get three equal channels, which most trainers of splats need",
    default=NO,
    choices=(YES, NO),
)


def grey_image(picture: ExportedPicture, path: str) -> LinkedFile | MadeFile:
    """Return the image in 8-bit grey at `path`, whose ending is .jpg or .png."""
    if _is_grey(picture) and picture.linkable("image", Path(path).suffix):
        return LinkedFile(path=path, source=picture.file("image"))
    return MadeFile(path=path, write=partial(_write_grey, picture))


def any_image(picture: ExportedPicture, path: str, *, rgb: bool = False) -> LinkedFile | MadeFile:
    """Return the image in 8 bits, grey or in colour as it is, or always in `rgb`, at `path`, whose ending is .jpg or
    .png."""
    if rgb and picture.picture.files["image"].channels == 1:
        return MadeFile(path=path, write=partial(_write_rgb, picture))
    if picture.linkable("image", Path(path).suffix) and picture.picture.files["image"].dtype == "uint8":
        return LinkedFile(path=path, source=picture.file("image"))
    return MadeFile(path=path, write=partial(_write_eight, picture))


def own_suffix(picture: ExportedPicture) -> str:
    """Return the ending for which `any_image` loses nothing of the dataset's image: .jpg or .png."""
    return ".jpg" if picture.linkable("image", ".jpg") else ".png"


def mask_image(picture: ExportedPicture, path: str) -> MadeFile:
    """Return the mask of the target at `path`, a grey PNG: 255 where it is visible, else 0."""
    return MadeFile(path=path, write=partial(_write_mask, picture))


def part_image(picture: ExportedPicture, path: str) -> MadeFile:
    """Return the part ids at `path`, a grey 8-bit PNG; the format's limits ensure that they fit."""
    return MadeFile(path=path, write=partial(_write_parts, picture))


def depth_image(picture: ExportedPicture, path: str, scale: float = 1.0) -> MadeFile:
    """Return depth at `path`, a grey 16-bit PNG of whole numbers of `scale` millimetres: planar z, 0 for nothing.
    Writing raises UnsupportedError for depth beyond 16 bits, since records lack an occluder's distance."""
    return MadeFile(path=path, write=partial(_write_depth, picture, scale))


def depth_numbers(depth: NDArray[np.float32], scale: float, where: str | None = None) -> NDArray[np.uint16]:
    """Return depth (H, W) in metres as whole numbers of `scale` millimetres; 0 stays 0. Raises UnsupportedError for
    depth beyond 16 bits."""
    steps = np.rint(depth.astype(np.float64) * (MILLIMETRES / scale))
    if steps.max(initial=0) > UINT16_MAX:
        far, most = float(depth.max()), UINT16_MAX * scale / MILLIMETRES
        found = f"is up to {far:g} m deep, and 16 bits of {scale:g} mm end at {most:g} m"
        do = "export without depth, or leave out the pictures with such distances"
        raise UnsupportedError(found, where=where, do=do)
    return steps.astype(np.uint16)


def grey(image: NDArray[Any]) -> NDArray[np.uint8]:
    """Return (H, W): an image of 8 or 16 bits, in colour or not, in 8-bit grey."""
    light = eight_bits(image)
    return light if light.ndim == 2 else np.rint(light @ np.array(LUMA)).astype(np.uint8)


def eight_bits(image: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the image in 8 bits: of 16, the upper ones."""
    return (image >> 8 if image.dtype == np.uint16 else image).astype(np.uint8)


def _is_grey(picture: ExportedPicture) -> bool:
    file = picture.picture.files["image"]
    return file.channels == 1 and file.dtype == "uint8"


def _write_grey(picture: ExportedPicture, path: Path) -> None:
    write_image(path, grey(picture.image), channels=("Y",))


def _write_eight(picture: ExportedPicture, path: Path) -> None:
    image = eight_bits(picture.image)
    write_image(path, image, channels=("Y",) if image.ndim == 2 else ("R", "G", "B"))


def _write_rgb(picture: ExportedPicture, path: Path) -> None:
    write_image(path, np.repeat(eight_bits(picture.image)[..., None], 3, -1), channels=("R", "G", "B"))


def _write_mask(picture: ExportedPicture, path: Path) -> None:
    write_image(path, picture.mask().view(np.uint8) * np.uint8(VISIBLE), channels=("Y",))


def _write_depth(picture: ExportedPicture, scale: float, path: Path) -> None:
    write_image(path, depth_numbers(picture.label("depth"), scale, picture.name), channels=("Y",))


def _write_parts(picture: ExportedPicture, path: Path) -> None:
    write_image(path, picture.label("segmentation").astype(np.uint8), channels=("Y",))

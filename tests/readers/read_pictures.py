"""Reads a dataset's image files with one of other people's readers, as its users do, and none of our code.

python read_pictures.py READER DATASET OUT: into the folder OUT a .npy for each image file, by the same path.
"""

import os
import sys
from pathlib import Path

import numpy as np

os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"


def opencv(path):
    import cv2

    image = cv2.imread(path, cv2.IMREAD_UNCHANGED)
    return image if image.ndim == 2 else image[..., [2, 1, 0, 3][: image.shape[2]]]  # its colours are B, G, R


def openexr(path):
    import OpenEXR

    with OpenEXR.File(path) as file:
        (channels,) = file.channels().values()  # it joins R, G, B and A
        return channels.pixels


def openimageio(path):
    import OpenImageIO

    image = OpenImageIO.ImageBuf(path)
    return image.get_pixels(image.spec().format)


def imageio(path):
    import imageio.v3

    # Of the plugins of EXR the one that downloads nothing; the usual one of PNG reads 16 bits of colour as 8.
    return imageio.v3.imread(path, plugin="opencv", flags=-1)


def blender(path):
    import bpy

    image = bpy.data.images.load(path)
    if path.endswith(".png"):
        image.colorspace_settings.name = "Non-Color"  # numbers as they are: it takes 16 bits for sRGB otherwise
    pixels = np.empty((image.size[1], image.size[0], image.channels), np.float32)
    image.pixels.foreach_get(pixels.reshape(-1))
    return pixels[::-1]  # RGBA from the bottom row up; of a PNG in the unit range


READERS = {reader.__name__: reader for reader in (opencv, openexr, openimageio, imageio, blender)}


def main(reader, dataset, out) -> None:
    suffixes = (".exr",) if reader == "openexr" else (".exr", ".png")
    for path in sorted(path for path in Path(dataset).glob("*/nominal/*") if path.suffix in suffixes):
        to = Path(out) / path.relative_to(dataset).with_suffix(".npy")
        to.parent.mkdir(parents=True, exist_ok=True)
        np.save(to, READERS[reader](str(path)).squeeze())


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Image files for tests, written by OpenImageIO."""

import numpy as np
import OpenImageIO as oiio  # noqa: N813  the name its own documentation uses

FLOAT_SUFFIXES = (".exr", ".hdr")


def write_image_file(path, values):
    """Write (H, W, C) in the format of the path's suffix, and return the path: whole numbers as they are in 8 bits;
    others as float32, or from 0 to 1 in a file of 8 bits."""
    values = np.asarray(values)
    values = np.ascontiguousarray(values, np.uint8 if values.dtype.kind in "iu" else np.float32)
    height, width, channels = values.shape
    kind = oiio.FLOAT if path.suffix in FLOAT_SUFFIXES else oiio.UINT8
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), oiio.ImageSpec(width, height, channels, kind))
    assert output.write_image(values)
    assert output.close()
    return path

"""The child's part of a page on a data set of somebody else: a picture with its labels drawn on it."""

from base64 import b64encode
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from spin_usd.audit.picture_measures import DrawPicture, Lens, MeasurePictures
from spin_usd.basics.arrays import Float
from spin_usd.commands.check.in_child.set_pictures import SetPicture, camera_of, grey_of
from spin_usd.formats.image_file import encoded_image

WIDTH = 420  # pixels
MASK, BOX, KEYPOINT = (255, 210, 0), (0, 220, 255), (255, 90, 255)
AXES = ((255, 60, 60), (60, 230, 60), (90, 140, 255))
QUALITY = 80
STEPS = 24  # points along an axis, since lenses bend it


def drawn_picture(request: DrawPicture) -> str:
    """Return a JPEG in base64: the picture with masks outlined, boxes, keypoints and the axes of poses; "" if it cannot
    be read."""
    files = request.picture
    reader = SetPicture(
        MeasurePictures(folder=request.folder, pictures=[files], lossy_masks=request.lossy_masks), files
    )
    image = reader.image()
    if image is None:
        return ""
    height, width = image.shape[:2]
    scale = WIDTH / width
    size = (WIDTH, max(1, round(height * scale)))
    grey = grey_of(image).clip(0, 255).astype(np.uint8)
    colour = image[..., :3] if image.ndim == 3 and image.dtype == np.uint8 and image.shape[2] >= 3 else grey
    canvas = cv2.resize(np.ascontiguousarray(colour), size, interpolation=cv2.INTER_AREA)
    canvas = np.ascontiguousarray(np.repeat(canvas[..., None], 3, 2) if canvas.ndim == 2 else canvas)
    for target in files.targets:
        read = reader.mask(target, (width, height))
        if read is not None:
            small = cv2.resize(read[0].astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
            cv2.drawContours(canvas, cv2.findContours(small, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0], -1, MASK, 1)
        if target.box is not None and np.isfinite(target.box).all():
            x0, y0, x1, y1 = np.rint(np.clip(target.box, -1e5, 1e5) * scale).astype(int).tolist()
            cv2.rectangle(canvas, (x0, y0), (x1, y1), BOX, 1)
        if target.pose is not None and files.lens is not None:
            _draw_axes(canvas, np.array(target.pose), files.lens, scale)
    for x, y in request.keypoints:
        if np.isfinite((x, y)).all():
            cv2.circle(canvas, (round(x * scale), round(y * scale)), 2, KEYPOINT, -1)
    return b64encode(encoded_image(canvas, ".jpg", channels=("R", "G", "B"), quality=QUALITY)).decode()


def _draw_axes(canvas: NDArray[Any], T: Float, lens: Lens, scale: float) -> None:
    """Draw the body's axes, x red, y green, z blue, an eighth of the picture's width long."""
    length = abs(T[2, 3]) * lens.size[0] / lens.projection[0] / 8
    along = np.linspace(0, length, STEPS)[:, None]
    for axis, colour in enumerate(AXES):
        points = camera_of(lens).project(along * T[:, axis] + T[:, 3]) * scale
        if np.isfinite(points).all() and np.abs(points).max() < 1e5:
            cv2.polylines(canvas, [np.rint(points).astype(np.int32)], False, colour, 1, cv2.LINE_AA)

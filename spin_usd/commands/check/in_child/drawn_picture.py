"""The child's part of a page on a data set of somebody else: a picture with its labels drawn on it."""

from base64 import b64encode
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from spin_usd.audit.picture_measures import DrawPicture, Lens, MeasurePictures
from spin_usd.basics.arrays import Float
from spin_usd.commands.check.in_child.set_pictures import SetPicture, box_around, camera_of, grey_of
from spin_usd.formats.image_file import encoded_image

WIDTH = 420  # pixels
AROUND, SMALLEST = 4.0, 64  # side of the part that is drawn, in sizes of the labels, and in pixels
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
    masks = [reader.mask(target, (width, height)) for target in files.targets]
    boxes = [target.box for target in files.targets if target.box is not None]
    boxes += [box for read in masks if read is not None and (box := box_around(read[0])) is not None]
    x0, y0, side = _shown(np.array(boxes).reshape(-1, 4), width, height)
    scale, corner = WIDTH / side, np.array([x0, y0])
    rows, columns = slice(y0, min(y0 + side, height)), slice(x0, min(x0 + side, width))
    grey = grey_of(image).clip(0, 255).astype(np.uint8)
    colour = image[..., :3] if image.ndim == 3 and image.dtype == np.uint8 and image.shape[2] >= 3 else grey
    part = np.ascontiguousarray(colour[rows, columns])
    size = (max(1, round(part.shape[1] * scale)), max(1, round(part.shape[0] * scale)))
    canvas = cv2.resize(part, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_NEAREST)
    canvas = np.ascontiguousarray(np.repeat(canvas[..., None], 3, 2) if canvas.ndim == 2 else canvas)
    for target, read in zip(files.targets, masks, strict=True):
        if read is not None:
            small = cv2.resize(read[0][rows, columns].astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
            cv2.drawContours(canvas, cv2.findContours(small, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0], -1, MASK, 1)
        if target.box is not None and np.isfinite(target.box).all():
            low, high = np.rint((np.clip(target.box, -1e5, 1e5).reshape(2, 2) - corner) * scale).astype(int).tolist()
            cv2.rectangle(canvas, low, high, BOX, 1)
        if target.pose is not None and files.lens is not None:
            _draw_axes(canvas, np.array(target.pose), files.lens, scale, corner)
    for point in np.array(request.keypoints).reshape(-1, 2):
        if np.isfinite(point).all():
            x, y = np.rint((point - corner) * scale).astype(int).tolist()
            cv2.circle(canvas, (x, y), 2, KEYPOINT, -1)
    return b64encode(encoded_image(canvas, ".jpg", channels=("R", "G", "B"), quality=QUALITY)).decode()


def _shown(boxes: Float, width: int, height: int) -> tuple[int, int, int]:
    """Return the corner and the side of a square around the labels, of four times their size; all of the picture where
    there are none or they are large."""
    boxes = boxes[np.isfinite(boxes).all(1)]
    if not len(boxes):
        return 0, 0, width
    low, high = boxes[:, :2].min(0).clip(0, (width, height)), boxes[:, 2:].max(0).clip(0, (width, height))
    side = int(max(AROUND * (high - low).max(), SMALLEST))
    if side >= width:
        return 0, 0, width
    x0, y0 = (np.clip((low + high - side) / 2, 0, np.maximum(np.array([width, height]) - side, 0))).astype(int).tolist()
    return x0, y0, side


def _draw_axes(canvas: NDArray[Any], T: Float, lens: Lens, scale: float, corner: Float) -> None:
    """Draw the body's axes, x red, y green, z blue, an eighth of the drawing's width long."""
    length = abs(T[2, 3]) * WIDTH / scale / lens.projection[0] / 8
    along = np.linspace(0, length, STEPS)[:, None]
    for axis, colour in enumerate(AXES):
        points = (camera_of(lens).project(along * T[:, axis] + T[:, 3]) - corner) * scale
        if np.isfinite(points).all() and np.abs(points).max() < 1e5:
            cv2.polylines(canvas, [np.rint(points).astype(np.int32)], False, colour, 1, cv2.LINE_AA)

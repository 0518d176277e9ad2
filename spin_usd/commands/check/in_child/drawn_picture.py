"""The child's part of a page on a data set of somebody else: a picture with its labels drawn on it."""

from base64 import b64encode
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from spin_usd.audit.picture_measures import DrawPicture, Lens, MeasurePictures, TargetFiles
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
    masks = [reader.mask(target, (image.shape[1], image.shape[0])) for target in files.targets]
    boxes = [target.box for target in files.targets if target.box is not None]
    boxes += [box for read in masks if read is not None and (box := box_around(read[0])) is not None]
    drawing = _Drawing(image, np.array(boxes).reshape(-1, 4))
    for target, read in zip(files.targets, masks, strict=True):
        drawing.add(target, None if read is None else read[0], files.lens)
    for point in np.array(request.keypoints).reshape(-1, 2):
        if np.isfinite(point).all():
            x, y = drawing.place(point)
            cv2.circle(drawing.canvas, (x, y), 2, KEYPOINT, -1)
    return b64encode(encoded_image(drawing.canvas, ".jpg", channels=("R", "G", "B"), quality=QUALITY)).decode()


class _Drawing:
    """The part of a picture (H, W) or (H, W, C) around boxes (N, 4), WIDTH pixels wide."""

    def __init__(self, image: NDArray[Any], boxes: Float) -> None:
        height, width = image.shape[:2]
        x0, y0, side = _shown(boxes, width, height)
        self.scale, self.corner = WIDTH / side, np.array([x0, y0])
        self.rows, self.columns = slice(y0, min(y0 + side, height)), slice(x0, min(x0 + side, width))
        grey = grey_of(image).clip(0, 255).astype(np.uint8)
        colour = image[..., :3] if image.ndim == 3 and image.dtype == np.uint8 and image.shape[2] >= 3 else grey
        part: NDArray[Any] = np.ascontiguousarray(colour[self.rows, self.columns])
        self.size = (max(1, round(part.shape[1] * self.scale)), max(1, round(part.shape[0] * self.scale)))
        way = cv2.INTER_AREA if self.scale < 1 else cv2.INTER_NEAREST
        canvas = np.asarray(cv2.resize(part, self.size, interpolation=way), np.uint8)
        self.canvas: NDArray[Any] = np.ascontiguousarray(
            np.repeat(canvas[..., None], 3, 2) if canvas.ndim == 2 else canvas
        )

    def place(self, point: Float) -> list[int]:
        """Return the pixel of the drawing for a pixel (2,) of the picture."""
        found: list[int] = np.rint((np.clip(point, -1e5, 1e5) - self.corner) * self.scale).astype(int).tolist()
        return found

    def add(self, target: TargetFiles, mask: NDArray[np.bool_] | None, lens: Lens | None) -> None:
        """Draw the labels of a target."""
        if mask is not None:
            part = mask[self.rows, self.columns].astype(np.uint8)
            small = cv2.resize(part, self.size, interpolation=cv2.INTER_NEAREST)
            outlines = cv2.findContours(small, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0]
            cv2.drawContours(self.canvas, outlines, -1, MASK, 1)
        if target.box is not None and np.isfinite(target.box).all():
            low, high = self.place(np.array(target.box[:2])), self.place(np.array(target.box[2:]))
            cv2.rectangle(self.canvas, low, high, BOX, 1)
        if target.pose is not None and lens is not None:
            self._axes(np.array(target.pose), lens)

    def _axes(self, T: Float, lens: Lens) -> None:
        """Draw the body's axes, x red, y green, z blue, an eighth of the drawing's width long."""
        length = abs(T[2, 3]) * WIDTH / self.scale / lens.projection[0] / 8
        along = np.linspace(0, length, STEPS)[:, None]
        for axis, colour in enumerate(AXES):
            points = (camera_of(lens).project(along * T[:, axis] + T[:, 3]) - self.corner) * self.scale
            if np.isfinite(points).all() and np.abs(points).max() < 1e5:
                cv2.polylines(self.canvas, [np.rint(points).astype(np.int32)], False, colour, 1, cv2.LINE_AA)


def _shown(boxes: Float, width: int, height: int) -> tuple[int, int, int]:
    """Return the corner and the side of a square around the labels, of four times their size; all of the picture where
    there are none or they are large."""
    boxes = boxes[np.isfinite(boxes).all(1)]
    if not len(boxes):
        return 0, 0, max(width, height)
    low, high = boxes[:, :2].min(0).clip(0, (width, height)), boxes[:, 2:].max(0).clip(0, (width, height))
    side = int(max(AROUND * (high - low).max(), SMALLEST))
    if side >= max(width, height):
        return 0, 0, max(width, height)
    x0, y0 = (np.clip((low + high - side) / 2, 0, np.maximum(np.array([width, height]) - side, 0))).astype(int).tolist()
    return x0, y0, side

"""The child's part of `check` where a set has neither masks nor boxes: how well a model's outline follows edges."""

import cv2
import numpy as np

from spin_usd.audit.picture_measures import Lens, MeasurePictures, PictureFiles, TraceOutlines
from spin_usd.audit.readings import MIRRORS
from spin_usd.basics.arrays import Float
from spin_usd.commands.check.in_child.set_pictures import SetPicture, camera_of, grey_of, projected_mask
from spin_usd.geometry.camera import Camera

WIDTH = 480  # pixels that pictures are reduced to: edges then are wider than errors of a model
SMALLEST = 12.0  # pixels of the reduced outline, below which no outline is followed


def outline_scores(request: TraceOutlines) -> list[list[float]]:
    """Return for each picture how strong the edges under the outline are: the mean rank, 0 to 1, of the gradient there
    among all of the outline's surroundings. 0.5 is chance; NaN where nothing can be followed.

    First for each pose, then for each pose with the picture mirrored left to right, then upside down.
    """
    return [
        _scores(request, files, [np.array(pose) for pose in poses])
        for files, poses in zip(request.pictures, request.poses, strict=True)
    ]


def _scores(request: TraceOutlines, files: PictureFiles, poses: list[Float]) -> list[float]:
    image = SetPicture(MeasurePictures(folder=request.folder, pictures=[files]), files).image()
    if image is None or files.lens is None or (image.shape[1], image.shape[0]) != files.lens.size:
        return [float("nan")] * len(poses) * len(MIRRORS)
    camera = _reduced(files.lens)
    grey = cv2.resize(grey_of(image).astype(np.float32), (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    grey = np.log1p(cv2.GaussianBlur(grey, (0, 0), 1))  # edges in shadow count as edges in light do
    strength = np.hypot(cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1))
    masks = [projected_mask(request.model, pose, camera) for pose in poses]
    mirrored = (strength, strength[:, ::-1], strength[::-1])
    return [_score(np.ascontiguousarray(each), mask) for each in mirrored for mask in masks]


def _reduced(lens: Lens) -> Camera:
    whole = camera_of(lens)
    scale = min(1.0, WIDTH / whole.width)
    width, height = max(1, round(whole.width * scale)), max(1, round(whole.height * scale))
    x, y = width / whole.width, height / whole.height
    return Camera(
        width=width,
        height=height,
        fx=whole.fx * x,
        fy=whole.fy * y,
        cx=whole.cx * x,
        cy=whole.cy * y,
        distortion=whole.distortion,
    )


def _score(strength: Float, mask: np.ndarray) -> float:
    size = int(np.sqrt(mask.sum()))
    if size < SMALLEST:
        return 0.0
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=1) > 0
    outline = mask & ~inner
    around = cv2.dilate(mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    ranks = np.searchsorted(np.sort(strength[around]), strength[outline]) / max(int(around.sum()), 1)
    return float(ranks.mean()) if len(ranks) else 0.0

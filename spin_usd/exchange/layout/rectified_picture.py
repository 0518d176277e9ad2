"""A picture as the same camera would take it without lens distortion.

Each pixel of the new picture takes the old picture's value along its ray. Images are interpolated between the centres
of four pixels. Labels are taken from the pixel that the ray falls in, since a mean of two part ids, or of depths before
and behind an edge, has no meaning: their outlines are off by up to half a pixel.
"""

from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, frozen
from spin_usd.exchange.layout.export_format import FormatOption
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.geometry.camera import Camera
from spin_usd.reading.description import DescribedTarget
from spin_usd.reading.pictured_target import PicturedTarget
from spin_usd.scene.mesh import BOX

OUTSIDE, MISSING = "outside", "missing"
RECTIFY, YES, NO = "rectify", "yes", "no"
RECTIFYING = FormatOption(name=RECTIFY, meaning="whether lens distortion is taken out", default=NO, choices=(YES, NO))
RECTIFY_IT = "take it out of the pictures: --option rectify=yes"
RECTIFIED = (
    "Lens distortion is taken out: images are interpolated between four pixels. Labels are those of the nearest "
    "pixel, so outlines of masks are off by up to half a pixel, and counts in masks are of these. Poses, models and "
    "projections are exact. Directions outside the lens's view are black.",
)
Array = NDArray[Any]


@dataclass(frozen=True, kw_only=True, eq=False)
class Resampling:
    """Where the pixels of a camera without distortion lie in the picture of one with it."""

    pinhole: Camera
    """The camera without distortion."""
    uv: Float
    """(H, W, 2) float64: pixels in the old picture, (0, 0) being its corner; 0 for none."""
    covered: NDArray[np.bool_]
    """(H, W): whether the old picture shows what the pixel sees; the lens may leave corners empty."""

    def nearest(self, old: Array) -> Array:
        """Return (H, W, ...) of the pixels of `old` (H, W, ...) that hold the places; 0 where it shows nothing."""
        return self._placed(_flat(old).take(self._holding, axis=0), old)

    def interpolated(self, old: Array) -> Array:
        """Return (H, W, ...) of whole numbers, bilinear between the pixel centres of `old` (H, W, ...); 0 where it
        shows nothing. Beyond the outermost centres, up to the rim, the outermost pixels go on."""
        first, right, down = self._between
        beside, below = (1 if old.shape[1] > 1 else 0), (old.shape[1] if len(old) > 1 else 0)
        flat = _flat(old)
        share = (slice(None), *[None] * (flat.ndim - 1))
        found = np.zeros((len(first), *flat.shape[1:]), np.float32)
        for step, weight in (
            (0, (1 - right) * (1 - down)),
            (beside, right * (1 - down)),
            (below, (1 - right) * down),
            (below + beside, right * down),
        ):
            found += weight[share] * flat.take(first + step, axis=0)
        return self._placed(np.rint(found).astype(old.dtype), old)

    @cached_property
    def _holding(self) -> NDArray[np.int32]:
        """(H * W,) the number of the pixel, row by row, that holds each place."""
        column, row = self.uv.reshape(-1, 2).astype(np.int32).T
        return row * np.int32(self.pinhole.width) + column

    @cached_property
    def _between(self) -> tuple[NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]:
        """(H * W,) the number of the upper left one of the four pixels around each place, and the shares of the right
        and of the lower ones."""
        size = np.array([self.pinhole.width, self.pinhole.height])
        place = np.clip(self.uv.reshape(-1, 2) - 0.5, 0, size - 1)
        first = np.minimum(place.astype(np.int32), np.maximum(size - 2, 0)).astype(np.int32)
        right, down = (place - first).astype(np.float32).T
        return first[:, 1] * np.int32(size[0]) + first[:, 0], right, down

    def _placed(self, pixels: Array, old: Array) -> Array:
        """Return the pixels (H * W, ...) as a picture shaped as `old`, with 0 for unknown ones."""
        new: Array = pixels.reshape(old.shape)
        new[~self.covered] = 0
        return new


@lru_cache(maxsize=1)
def resampling(camera: Camera) -> Resampling:
    """Return how a picture of the camera becomes one without distortion, of the same size, focal lengths and principal
    point."""
    pinhole = camera.pinhole
    xy = pinhole.centres(pinhole.frame)
    uv = camera.project(np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], -1))
    with np.errstate(invalid="ignore"):
        covered = ((uv >= 0) & (uv < (camera.width, camera.height))).all(-1)
    return Resampling(pinhole=pinhole, uv=np.where(covered[..., None], uv, 0), covered=covered)


def _flat(picture: Array) -> Array:
    """Return the picture (H, W, ...) with its pixels one after another, (H * W, ...)."""
    return picture.reshape(-1, *picture.shape[2:])


class RectifiedPicture(ExportedPicture):
    """The picture resampled: its image interpolated, its labels looked up in the nearest pixel.

    Pixel facts of its targets are computed again. Points are projected exactly; a point in the frame keeps its
    visibility, since the ray to it is the same. The box of the projected surface is not known, so it is NaN; whether a
    target is truncated, and which share of it is visible, stay as they were with distortion.
    """

    @classmethod
    def of(cls, picture: ExportedPicture) -> "RectifiedPicture":
        """Return it for a picture with distortion or without."""
        return cls(**{field.name: getattr(picture, field.name) for field in fields(picture)})

    @property
    def camera(self) -> Camera:
        """The camera without distortion."""
        return self._resampling.pinhole

    @property
    def image(self) -> NDArray[Any]:
        """The image, (H, W) or (H, W, 3), 8 or 16 bits, interpolated."""
        return self._resampling.interpolated(super().image)

    def label(self, kind: str) -> NDArray[Any]:
        """Return the label of that name by nearest pixels. Raises InputError if the picture lacks it."""
        return self._resampling.nearest(super().label(kind))

    def linkable(self, kind: str, suffix: str) -> bool:
        """Return False: no file of the dataset has the exported content."""
        return False

    def mask(self, target: int | None = None) -> NDArray[np.bool_]:
        """Return (H, W): the pixels in which the target with that id, or else `target`, is visible."""
        return self._resampling.nearest(super().mask(target))

    @cached_property
    def targets(self) -> tuple[PicturedTarget, ...]:
        """All targets in order of their ids."""
        described = self.picture.description.targets
        return tuple(map(self._rectified, self.picture.targets, described))

    @property
    def _resampling(self) -> Resampling:
        return resampling(self.picture.camera)

    def _rectified(self, target: PicturedTarget, described: DescribedTarget) -> PicturedTarget:
        mask = self.mask(target.id)
        shaped = target.shaped_keypoints
        keypoints = self._projected(target, described.keypoints.points if shaped is None else shaped)
        size = (self.camera.width, self.camera.height)
        states = zip(target.keypoint_states, keypoints, strict=True)
        return replace(
            target,
            box_visible=frozen(_box(mask)),
            box_amodal=frozen(np.full(4, np.nan)),
            pixels_visible=int(mask.sum()),
            pixels_amodal=int(self.amodal_mask(target.id).sum()),
            box_3d=self._projected(target, np.where(BOX, target.box[1], target.box[0])),
            keypoints=keypoints,
            keypoint_states=tuple(
                OUTSIDE if _left(pixel, size) and state != MISSING else state for state, pixel in states
            ),
        )

    def _projected(self, target: PicturedTarget, points: Float) -> Float:
        """Return the pixels (N, 2) of points (N, 3) in the target's axes."""
        return frozen(self.camera.project(points @ target.T_cam_body[:3, :3].T + target.T_cam_body[:3, 3]))


def _box(mask: NDArray[np.bool_]) -> Float:
    """Return x0, y0, x1, y1 around the mask (H, W), (0, 0) being the corner of the image; NaN where it is empty."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    ends = [columns[0], rows[0], columns[-1] + 1, rows[-1] + 1] if len(rows) else [np.nan] * 4
    return np.array(ends, np.float64)


def _left(pixel: Float, size: tuple[int, int]) -> bool:
    """Return whether the pixel (2,) lies outside an image of that size; False without an image."""
    return bool(((pixel < 0) | (pixel >= size)).any())


def as_exported(dataset: ExportedDataset, picture: ExportedPicture) -> ExportedPicture:
    """Return the picture, without lens distortion if requested."""
    return RectifiedPicture.of(picture) if dataset.options.get(RECTIFY) == YES else picture


def exported_cameras(dataset: ExportedDataset) -> tuple[Camera, ...]:
    """Return the cameras of the pictures as exported, each once."""
    return tuple(dict.fromkeys(as_rectified(each, dataset) for each in dataset.cameras))


def as_rectified(camera: Camera, dataset: ExportedDataset) -> Camera:
    """Return the camera, without lens distortion if requested."""
    return camera.pinhole if dataset.options.get(RECTIFY) == YES else camera

"""The child's part of `check` of a data set of somebody else: pixels of images, masks and depth."""

import os
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from spin_usd.audit.annotated_set import DepthSource, MaskSource
from spin_usd.audit.picture_measures import (
    Lens,
    MeasurePictures,
    ModelFile,
    PictureFiles,
    PictureMeasures,
    Silhouette,
    TargetFiles,
    TargetMeasures,
)
from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import decoding, reading
from spin_usd.errors import InputError, SpinError
from spin_usd.files.size_limits import MAX_ARRAY
from spin_usd.files.user_file import open_file, read_bytes
from spin_usd.formats.image_file import jpeg_is_whole, read_image
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.scene.asset import MeshPart

Mask = NDArray[np.bool_]
DARK = 10.0  # steps of 8 bits above the background from which a pixel is lit
MOST_LIT = 0.5  # share of lit pixels beyond which the background is not dark
FIELDS = 16  # fields across a picture's look
NEAR_UNIFORM = 4.0  # steps of 8 bits between a field and most of them
FEWEST_FIELDS = 8  # that differ, below which all small targets look alike
WHITE, BLACK = 250, 5
SUBPIXEL_BITS = 4
MAX_PIXEL = 1e5  # of an outline, beyond any picture
MAX_DIGIT, MAX_SHIFT = 64, 60  # of COCO's compressed run lengths: values and bits
CODES = np.arange(1, 121)  # of 8 bits, where the curve's steps leave gaps
MIN_CODES = 12  # different codes for a verdict on gaps


def set_picture_measures(request: MeasurePictures) -> list[PictureMeasures]:
    """Return the measures of each picture."""
    return [SetPicture(request, picture).measures() for picture in request.pictures]


class SetPicture:
    """One picture's files, read once."""

    def __init__(self, request: MeasurePictures, files: PictureFiles) -> None:
        self.request, self.files, self.root = request, files, Path(request.folder)
        self.errors: dict[str, str] = {}
        self.odd_size: tuple[int, int] | None = None

    def measures(self) -> PictureMeasures:
        image = self.image()
        size = None if image is None else (image.shape[1], image.shape[0])
        grey = None if image is None else grey_of(image)
        lit = None if grey is None else _lit(grey)
        masks = [self.mask(target, size) for target in self.files.targets]
        depth = self._depth(self.files.depth, size) if self.files.depth else None
        targets = [
            self._target(target, read, depth, lit, _union([each[0] for each in masks if each and each is not read]))
            for target, read in zip(self.files.targets, masks, strict=True)
        ]
        several = None if image is None or image.ndim == 2 else image[..., :3]
        return PictureMeasures(
            name=self.files.name,
            errors=self.errors,
            size=size,
            mask_size=self.odd_size,
            equal_channels=None if several is None else bool((several == several[..., :1]).all()),
            sha256=self._digest(),
            look="" if grey is None else _look(grey),
            twice_encoded=image is not None and _twice_encoded(image, self.files.name),
            lit_box=None if lit is None else box_around(lit, trim=0.01),
            targets=targets,
        )

    def _path(self, name: str) -> Path:
        """Return the path of a file. Raises InputError for one outside the set's folder."""
        path = self.root / name
        real, root = os.path.realpath(path), os.path.realpath(self.root)
        if not real.startswith(f"{root}{os.sep}"):
            raise InputError("lies outside the set's folder, and is not read", where=name)
        return path

    def image(self) -> NDArray[Any] | None:
        """Return the image (H, W) or (H, W, C); None, and an error, if it cannot be read."""
        if not self.files.name:
            return None
        image = self._read(self.files.name)
        return None if image is None else image.squeeze()

    def _read(self, name: str) -> NDArray[Any] | None:
        try:
            with reading(name):
                return read_image(self._path(name))[0]
        except SpinError as error:
            self.errors[name] = error.found
            return None

    def _digest(self) -> str:
        if not self.files.name or self.files.name in self.errors:
            return ""
        data = read_bytes(self._path(self.files.name), MAX_ARRAY)
        if self.files.name.lower().endswith((".jpg", ".jpeg")) and not jpeg_is_whole(data):
            self.errors[self.files.name] = "is cut short"
        return sha256(data).hexdigest()

    def mask(self, target: TargetFiles, size: tuple[int, int] | None) -> tuple[Mask, float] | None:
        """Return the mask (H, W), and the share of its pixels that are neither black nor white."""
        if target.mask is None:
            return None
        try:
            with reading(target.mask.file or self.files.name):
                mask, grey = self._decoded(target.mask)
        except (SpinError, ValueError, IndexError, TypeError) as error:
            self.errors[target.mask.file or f"{self.files.name}: mask"] = getattr(error, "found", "is damaged")
            return None
        return (mask, grey) if self._fits(mask, size) else None

    def _fits(self, labels: NDArray[Any], size: tuple[int, int] | None) -> bool:
        there = (labels.shape[1], labels.shape[0])
        if size is not None and there != size:
            self.odd_size = there
        return size is None or there == size

    def _decoded(self, source: MaskSource) -> tuple[Mask, float]:
        if source.file:
            pixels = read_image(self._path(source.file))[0]
            pixels = pixels if pixels.ndim == 2 else pixels[..., :3].max(-1)
            mask = pixels > (WHITE // 2 if self.request.lossy_masks else 0)
            between = (pixels > BLACK) & (pixels < WHITE) & mask
            return mask, _share(between, mask)
        height, width = source.size or (0, 0)
        if not 0 < height * width <= MAX_ARRAY // 4:
            raise InputError("gives no size of its mask")
        if source.polygons:
            canvas = np.zeros((height, width), np.uint8)
            outlines = [np.array(each, np.float64).reshape(-1, 2) for each in source.polygons if len(each) >= 6]
            if not all(np.isfinite(each).all() for each in outlines):
                raise InputError("has an outline of no numbers")
            rings = [_fixed(np.clip(each, -MAX_PIXEL, MAX_PIXEL) - 0.5) for each in outlines]
            cv2.fillPoly(canvas, rings, 1, shift=SUBPIXEL_BITS)
            return canvas > 0, 0.0
        runs = _uncompressed(source.counts) if isinstance(source.counts, str) else source.counts
        if min(runs, default=0) < 0 or sum(runs) != height * width:
            raise InputError(f"has run lengths of {sum(runs)} pixels for {width} x {height}")
        flat = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
        return flat.reshape(width, height).T, 0.0

    def _depth(self, source: DepthSource, size: tuple[int, int] | None) -> Float | None:
        """Return depth (H, W) in metres, 0 for nothing."""
        try:
            with reading(source.file):
                if source.file.endswith(".npz"):
                    depth = _array(self._path(source.file))
                else:
                    depth = read_image(self._path(source.file))[0].squeeze()
        except (SpinError, ValueError, zipfile.BadZipFile) as error:
            self.errors[source.file] = getattr(error, "found", "is damaged")
            return None
        metres = np.where(np.isfinite(depth), depth, 0).astype(np.float64) * source.metres
        if source.nothing:
            metres = np.where(metres >= source.nothing, 0, metres)
        return metres if metres.ndim == 2 and self._fits(metres, size) else None

    def _target(
        self,
        target: TargetFiles,
        read: tuple[Mask, float] | None,
        depth: Float | None,
        lit: Mask | None,
        others: Mask | None,
    ) -> TargetMeasures:
        """Return the measures of a target; `others`: pixels of all other targets."""
        mask = None if read is None else read[0]
        inside, region = None, mask
        if region is None and target.box is not None and lit is not None:
            region = _filled(target.box, lit.shape)
        if lit is not None and region is not None and region.any():
            mirrored = (region, region[:, ::-1], region[::-1], region[::-1, ::-1])
            inside = tuple(_share(lit & each, lit) for each in mirrored)
        seen = None if depth is None else (depth > 0 if mask is None else mask & (depth > 0))
        rows, columns = np.nonzero(mask) if mask is not None else (np.zeros(0), np.zeros(0))
        return TargetMeasures(
            box=None if mask is None else box_around(mask),
            pixels=len(rows),
            centre=(float(columns.mean()) + 0.5, float(rows.mean()) + 0.5) if len(rows) else None,
            grey=0.0 if read is None else read[1],
            lit=(inside[0], inside[1], inside[2], inside[3]) if inside else None,
            depth=float(np.median(depth[seen])) if depth is not None and seen is not None and seen.any() else None,
            without_depth=_without(mask, depth),
            beside_mask=_beside(mask, depth) if len(self.files.targets) == 1 else 0.0,
            silhouette=self._silhouette(target, mask, others) if mask is not None and len(rows) else None,
        )

    def _silhouette(self, target: TargetFiles, mask: Mask, others: Mask | None) -> Silhouette | None:
        model = self.request.models.get(target.id, self.request.models.get(""))
        lens = self.files.lens
        if model is None or target.pose is None or lens is None or (mask.shape[1], mask.shape[0]) != lens.size:
            return None
        projected = projected_mask(model, np.array(target.pose), camera_of(lens))
        if others is not None:
            projected &= ~others  # which may hide it
        if not projected.any():
            return Silhouette(iou=0.0, shift=(0.0, 0.0), edge=0.0)
        differing = (mask ^ projected) & ~_rim(projected)
        iou = 1 - _share(differing, mask | projected)
        apart = [np.array([axis.mean() for axis in np.nonzero(each)[::-1]]) for each in (mask, projected)]
        shift = apart[0] - apart[1]
        return Silhouette(iou=iou, shift=(float(shift[0]), float(shift[1])), edge=_edge_offset(mask, projected))


def _union(masks: Sequence[Mask]) -> Mask | None:
    return np.any(masks, axis=0) if masks else None


def _rim(mask: Mask) -> Mask:
    """Return the pixels at the edge of a mask, one inside and one outside, which may be rounded to either."""
    whole, near = mask.astype(np.uint8), np.ones((3, 3), np.uint8)
    return (cv2.dilate(whole, near) > 0) & ~(cv2.erode(whole, near, borderValue=1) > 0)


def projected_mask(model: tuple[str, float], T: Float, camera: Camera) -> Mask:
    """Return the silhouette (H, W) of a model file, with metres of its unit, under T_cam_body (3, 4)."""
    points, faces = _mesh(model[0])
    pixels = camera.project(points * model[1] @ T[:, :3].T + T[:, 3])
    triangles = pixels[faces]
    triangles = triangles[np.isfinite(triangles).all((1, 2)) & (np.abs(triangles) < 1e5).all((1, 2))]
    canvas = np.zeros((camera.height, camera.width), np.uint8)
    for triangle in _fixed(triangles - 0.5):
        cv2.fillConvexPoly(canvas, triangle, 1, shift=SUBPIXEL_BITS)
    return canvas > 0


def _without(mask: Mask | None, depth: Float | None) -> float:
    """Return the share of the mask without depth."""
    return 0.0 if mask is None or depth is None else _share(mask & (depth == 0), mask)


def _beside(mask: Mask | None, depth: Float | None) -> float:
    """Return the share of the pixels with depth outside the mask."""
    return 0.0 if mask is None or depth is None or not mask.any() else _share((depth > 0) & ~mask, depth > 0)


def _share(part: Mask, whole: Mask) -> float:
    return int(np.count_nonzero(part)) / max(int(np.count_nonzero(whole)), 1)


def _edge_offset(mask: Mask, projected: Mask) -> float:
    """Return the median signed distance of the mask's inner edge from the projection's edge, pixels."""
    outside = cv2.distanceTransform((~projected).astype(np.uint8), cv2.DIST_L2, 5)
    inside = cv2.distanceTransform(projected.astype(np.uint8), cv2.DIST_L2, 5)
    edge = mask & ~cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=1).astype(bool)
    signed = np.where(projected, 1 - inside, outside)
    return float(np.median(signed[edge])) if edge.any() else 0.0


@lru_cache(maxsize=8)
def _mesh(path: str) -> tuple[Float, NDArray[np.int64]]:
    """Return points (N, 3) and triangles (M, 3) of a model file."""
    points, faces, count = [], [], 0
    for part in read_mesh_file(Path(path), 1.0).parts:
        copies = np.eye(4)[None] if part.copies is None else part.copies
        for copy in copies:
            points.append(part.points @ copy[:3, :3].T + copy[:3, 3])
            faces.append(_fans(part) + count)
            count += len(part.points)
    return np.concatenate(points), np.concatenate(faces)


def _fans(part: MeshPart) -> NDArray[np.int64]:
    """Return the triangles (M, 3) around the first corner of each face."""
    starts = np.repeat(part.face_starts, part.face_counts - 2)
    ends = np.cumsum(part.face_counts - 2)
    within = np.arange(len(starts)) - np.repeat(ends - (part.face_counts - 2), part.face_counts - 2)
    corners = np.stack([starts, starts + within + 1, starts + within + 2], 1)
    return part.face_indices[corners].astype(np.int64)


def model_points(request: ModelFile) -> list[list[float]]:
    """Return the points of a model's convex hull, metres."""
    points, _ = _mesh(request.path)
    with suppress(QhullError):  # a flat model has no hull
        points = points[ConvexHull(points).vertices]
    hull: list[list[float]] = (points * request.unit).tolist()
    return hull


def camera_of(lens: Lens) -> Camera:
    fx, fy, cx, cy = lens.projection
    distortion = Fisheye(*lens.distortion) if lens.fisheye else tuple(lens.distortion)
    return Camera(width=lens.size[0], height=lens.size[1], fx=fx, fy=fy, cx=cx, cy=cy, distortion=distortion)


def _fixed(pixels: Float) -> NDArray[np.int32]:
    """Return pixels in OpenCV's fixed point; its pixel centres are at whole numbers."""
    return np.rint(pixels * (1 << SUBPIXEL_BITS)).astype(np.int32)


def grey_of(image: NDArray[Any]) -> Float:
    """Return (H, W) brightness in steps of 8 bits."""
    grey = image[..., :3].mean(-1) if image.ndim == 3 else image.astype(np.float64)
    return np.asarray(grey / 257 if image.dtype == np.uint16 else grey, np.float64)


def _lit(grey: Float) -> Mask | None:
    """Return which pixels are lit; None where the background is not dark."""
    level = np.percentile(grey[::4, ::4], 25)
    noise = 1.4826 * np.median(np.abs(grey[::4, ::4][grey[::4, ::4] <= level + DARK] - level))
    lit = grey > level + max(DARK, 5 * noise)
    return lit if 0 < lit.mean() < MOST_LIT else None


def _look(grey: Float) -> str:
    small = cv2.resize(grey.astype(np.float32), (FIELDS, FIELDS), interpolation=cv2.INTER_AREA)
    return (
        ""
        if (np.abs(small - np.median(small)) > NEAR_UNIFORM).sum() < FEWEST_FIELDS
        else np.rint(small).astype(np.uint8).tobytes().hex()
    )


def _twice_encoded(image: NDArray[Any], name: str) -> bool:
    """Return whether the values of an 8-bit PNG have the gaps that an sRGB curve over 8-bit values leaves."""
    if image.dtype != np.uint8 or not name.lower().endswith(".png"):
        return False
    linear = np.arange(256) / 255
    codes = np.rint(255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)).astype(
        int
    )
    counts = np.bincount(image.ravel(), minlength=256)
    made = np.isin(CODES, codes)
    there = counts[CODES] > 0
    return bool((there & made).sum() >= MIN_CODES and not (there & ~made).any())


def box_around(mask: Mask, trim: float = 0.0) -> list[float] | None:
    """Return x0, y0, x1, y1 around the pixels, without the share `trim` of them on each side."""
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return None
    low, high = np.quantile(np.stack([columns, rows]), (trim, 1 - trim), axis=1)
    return [*low.tolist(), *(high + 1).tolist()]


def _filled(box: list[float], shape: tuple[int, ...]) -> Mask:
    region = np.zeros(shape[:2], bool)
    if np.isfinite(box).all():
        x0, y0, x1, y1 = (max(0, round(min(each, 1e6))) for each in box)
        region[y0:y1, x0:x1] = True
    return region


def _array(path: Path) -> NDArray[Any]:
    """Return the only array of an .npz file. Raises InputError."""
    with open_file(path, MAX_ARRAY) as file, decoding(path):
        arrays = np.load(file, allow_pickle=False)
        name = arrays.files[0]
        shape = _shape(arrays, name)
        if np.prod(shape) * 8 > MAX_ARRAY:
            raise InputError(f"holds an array of {shape}")
        return np.asarray(arrays[name])


def _shape(arrays: Any, name: str) -> tuple[int, ...]:
    """Return the shape of an array of an .npz file, before its values are decompressed."""
    with arrays.zip.open(f"{name}.npy") as member:
        version = np.lib.format.read_magic(member)
        head = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape: tuple[int, ...] = head(member)[0]
    return shape


def _uncompressed(text: str) -> list[int]:
    """Return the run lengths of COCO's compressed text."""
    runs: list[int] = []
    for value in _numbers(text):
        runs.append(value + (runs[-2] if len(runs) > 2 else 0))
    return runs


def _numbers(text: str) -> Iterator[int]:
    value, shift = 0, 0
    for character in text:
        digit = ord(character) - 48
        if not 0 <= digit < MAX_DIGIT or shift > MAX_SHIFT:
            raise InputError("holds damaged run lengths")
        value |= (digit & 0x1F) << shift
        shift += 5
        if not digit & 0x20:
            yield value - (1 << shift) if digit & 0x10 else value
            value, shift = 0, 0

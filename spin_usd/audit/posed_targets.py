"""The poses of a set as arrays: of each target that has a camera and finite numbers."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget
from spin_usd.audit.picture_measures import PictureMeasures, TargetMeasures
from spin_usd.basics.arrays import Float
from spin_usd.errors import GeometryError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrices_from_quaternions

EDGE = 1.5  # pixels from the frame's rim within which a box may be cut off


@dataclass(frozen=True, kw_only=True)
class AuditedPicture:
    """A picture with what its files measure."""

    labels: AnnotatedPicture
    measures: PictureMeasures | None
    """None where its files were not read."""

    @property
    def name(self) -> str:
        return self.labels.name

    def targets(self) -> Iterator[tuple[AnnotatedTarget, TargetMeasures | None]]:
        """Yield each target and its measures."""
        measured = self.measures.targets if self.measures else ()
        for place, target in enumerate(self.labels.targets):
            yield target, measured[place] if place < len(measured) else None


@dataclass(frozen=True, kw_only=True)
class AuditedSet:
    """A data set with what its files measure."""

    labels: AnnotatedSet
    pictures: Sequence[AuditedPicture]

    @cached_property
    def posed(self) -> "Mapping[str, PosedTargets]":
        """Targets with poses, by id."""
        rows: dict[str, list[tuple[AuditedPicture, Camera, AnnotatedTarget, TargetMeasures | None]]] = defaultdict(list)
        for picture in self.pictures:
            camera = picture.labels.camera
            for target, measured in picture.targets():
                if camera is not None and usable(target):
                    rows[target.id].append((picture, camera, target, measured))
        return {key: PosedTargets(rows=each, labels=self.labels) for key, each in rows.items()}


def usable(target: AnnotatedTarget) -> bool:
    """Return whether the target has finite numbers of a pose."""
    rotation, place = target.rotation, target.t_cam_body
    if rotation is None or place is None or not (np.isfinite(rotation).all() and np.isfinite(place).all()):
        return False
    return bool(np.abs(rotation).max() > 0 and np.abs(place).max() < 1e12)


@dataclass(frozen=True, kw_only=True)
class PosedTargets:
    """All targets of one id that have poses and a camera, N of them."""

    rows: Sequence[tuple[AuditedPicture, Camera, AnnotatedTarget, TargetMeasures | None]]
    labels: AnnotatedSet

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def names(self) -> list[str]:
        """Names of the pictures."""
        return [picture.name for picture, *_ in self.rows]

    @cached_property
    def matrices(self) -> Float:
        """(N, 3, 3) the set's matrices as written; NaN for quaternions."""
        none = np.full((3, 3), np.nan)
        return np.array([t.rotation if _of_shape(t, (3, 3)) else none for _, _, t, _ in self.rows])

    @cached_property
    def quaternions(self) -> Float:
        """(N, 4) as written, the scalar first; NaN for matrices."""
        none = np.full(4, np.nan)
        return np.array([t.rotation if _of_shape(t, (4,)) else none for _, _, t, _ in self.rows])

    def rotations(self, *, other_order: bool = False, inverse: bool = False) -> Float:
        """Return R_cam_body (N, 3, 3), with the quaternion's scalar where the layout has it or at the other end, and of
        the rotations as written or of their inverse."""
        if np.isfinite(self.matrices).all():
            return self.matrices.transpose(0, 2, 1) if inverse else self.matrices
        q = np.roll(self.quaternions, -1 if self.labels.scalar_last else 1, 1) if other_order else self.quaternions
        q = self.labels.q_cam_body(q * [1, -1, -1, -1] if inverse else q)
        return matrices_from_quaternions(q / np.linalg.norm(q, axis=1, keepdims=True))

    @cached_property
    def t(self) -> Float:
        """(N, 3) positions as written, metres."""
        return np.array([target.t_cam_body for _, _, target, _ in self.rows])

    @cached_property
    def sizes(self) -> Float:
        """(N, 2) width and height, pixels."""
        return np.array([(camera.width, camera.height) for _, camera, _, _ in self.rows], np.float64)

    @cached_property
    def focal(self) -> Float:
        """(N,) fx, pixels."""
        return np.array([camera.fx for _, camera, _, _ in self.rows])

    def some(self, count: int) -> "PosedTargets":
        """Return at most about `count` of them, evenly spread."""
        return PosedTargets(rows=self.rows[:: -(-len(self) // count)], labels=self.labels)

    def at(self, places: Sequence[int]) -> "PosedTargets":
        """Return those at some places."""
        return PosedTargets(rows=[self.rows[place] for place in places], labels=self.labels)

    def keypoints(self, count: int) -> Float:
        """Return (N, count, 3) keypoints, NaN where a target has none."""
        none = np.full((count, 3), np.nan)
        return np.array([none if target.keypoints is None else target.keypoints for _, _, target, _ in self.rows])

    @cached_property
    def _by_camera(self) -> list[tuple[Camera, NDArray[np.intp]]]:
        places: dict[str, list[int]] = defaultdict(list)
        for place, (_, camera, _, _) in enumerate(self.rows):
            places[camera.key].append(place)
        return [(self.rows[each[0]][1], np.array(each)) for each in places.values()]

    def undistorted(self, uv: Float, there: NDArray[np.bool_]) -> Float:
        """Return normalised coordinates (N, K, 2) of the pixels that are `there` (N, K); NaN for others."""
        found = np.full(uv.shape, np.nan)
        for camera, places in self._by_camera:
            rows, columns = np.nonzero(there[places])
            if len(rows):
                found[places[rows], columns] = camera.normalised(uv[places[rows], columns])
        return found

    @cached_property
    def boxes(self) -> Float:
        """(N, 4) boxes in pixels: of the mask, else the label's, else of the lit pixels; NaN without any."""
        return np.array([_best_box(*row) for row in self.rows]).reshape(-1, 4)

    @cached_property
    def from_image(self) -> NDArray[np.bool_]:
        """(N,) whether boxes are of lit pixels alone."""
        return np.array([_label_box(target, measured) is None for _, _, target, measured in self.rows], bool)

    @cached_property
    def diagonals(self) -> Float:
        """(N,) lengths of the boxes' diagonals at the bodies' distances, metres; NaN where the frame cuts one off."""
        boxes, z = self.normalised(self.boxes), self.t[:, 2]
        whole = np.isfinite(boxes).all(1) & (z > 0)
        found = np.full(len(self), np.nan)
        found[whole] = np.linalg.norm(boxes[whole, 2:] - boxes[whole, :2], axis=1) * z[whole]
        return found

    @cached_property
    def unlabelled(self) -> NDArray[np.bool_]:
        """(N,) whether a target has neither box, mask nor keypoints, in an image that exists."""
        return np.array(
            [p.labels.exists and t.box is None and t.mask is None and t.keypoints is None for p, _, t, _ in self.rows],
            bool,
        )

    def normalised(self, boxes: Float) -> Float:
        """Return the boxes (N, 4) in normalised coordinates without the lens's distortion; sides at the frame's rim are
        infinite, since targets go on beyond."""
        found = np.full((len(self), 4), np.nan)
        for camera, places in self._by_camera:
            there = places[np.isfinite(boxes[places]).all(1)]
            if len(there):
                found[there] = _undistorted(camera, boxes[there])
        return found


def _undistorted(camera: Camera, boxes: Float) -> Float:
    x0, y0, x1, y1 = boxes.T
    middle = (boxes[:, :2] + boxes[:, 2:]) / 2
    sides = [
        np.stack([x0, middle[:, 1]], 1),
        np.stack([middle[:, 0], y0], 1),
        np.stack([x1, middle[:, 1]], 1),
        np.stack([middle[:, 0], y1], 1),
    ]
    try:
        points = camera.normalised(np.clip(np.stack(sides, 1), -1e5, 1e5))
    except GeometryError:
        points = camera.pinhole.normalised(np.clip(np.stack(sides, 1), -1e5, 1e5))
    found = np.stack([points[:, 0, 0], points[:, 1, 1], points[:, 2, 0], points[:, 3, 1]], 1)
    found[x0 <= EDGE, 0], found[y0 <= EDGE, 1] = -np.inf, -np.inf
    found[x1 >= camera.width - EDGE, 2], found[y1 >= camera.height - EDGE, 3] = np.inf, np.inf
    return np.asarray(found)


def _label_box(target: AnnotatedTarget, measured: TargetMeasures | None) -> Float | None:
    if measured is not None and measured.box is not None:
        return np.array(measured.box)
    box = target.box
    return box if box is not None and np.isfinite(box).all() and (box[2:] > box[:2]).all() else None


def _best_box(
    picture: AuditedPicture, camera: Camera, target: AnnotatedTarget, measured: TargetMeasures | None
) -> Float:
    box = _label_box(target, measured)
    lit = picture.measures.lit_box if picture.measures else None
    if box is None and lit is not None and len(picture.labels.targets) == 1 and target.mask is None:
        box = np.array(lit)
    return np.full(4, np.nan) if box is None else box


def _of_shape(target: AnnotatedTarget, shape: tuple[int, ...]) -> bool:
    return target.rotation is not None and target.rotation.shape == shape

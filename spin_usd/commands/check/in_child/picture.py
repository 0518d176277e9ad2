"""The child's part of `check` of a dataset: what is wrong with one picture, and what its record lists, as JSON."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from msgspec import convert
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.commands.check.answers import ListedPicture, PictureAnswer
from spin_usd.commands.check.digests import MAKE_AGAIN, digest_findings
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.checked_target import CheckedTarget, targets_of
from spin_usd.commands.check.in_child.keypoints import keypoint_findings
from spin_usd.commands.check.in_child.labels import count_findings, label_findings
from spin_usd.errors import InputError, SpinError
from spin_usd.faults import reading
from spin_usd.files.folder import FileIn, Folder
from spin_usd.picture.brightness import tone_findings
from spin_usd.picture.target_facts import corners_of_box
from spin_usd.reading.description import Named
from spin_usd.reading.picture_file import read_picture_file
from spin_usd.records.descriptions import DatasetDescription
from spin_usd.records.record import Record, RecordedFile
from spin_usd.scene.finding import Finding
from spin_usd.store.cache import uses
from spin_usd.store.json_schema import read_json
from spin_usd.store.names import picture_of
from spin_usd.store.read_documents import read_dataset_json

CENTRE_PX = 0.5  # a pixel shows what its centre does
ROUNDING_PX = 1e-3
ROUNDING = 1e-6  # of a target's size: dense pose is float32
AWAY_PX, AWAY_SHARE = 1e-3, 1e-7  # of a pixel, and of where it is: the record's quaternion is rounded
SAMPLES = 2000  # pixels of a target
MIN_PIXELS = 20  # fewer may lie on a line
NOISE_PX = 1e-3  # what a pixel's point may lie beside its pixel: float32 rounds to less
MIN_DEGREES, MIN_METRES = 1e-5, 1e-7  # where many pixels leave less than rounding in OpenCV
MAX_DEGREES = 1.0  # where so much is allowed, the target is too small for the rule to say anything
LENGTH = 1e-12  # of a range: orders of addition differ
REFINED = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-15)


@dataclass(frozen=True, kw_only=True)
class PoseError:
    """How far the pose from the dense pose is from the record's, and how far NOISE_PX may move it."""

    degrees: float
    metres: float
    allowed_degrees: float
    allowed_metres: float


def pose_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield an error for each target whose pose differs by more than rounding makes of it, or whose range is not the
    length of its translation, and one where the picture's own pose is not that of its first target."""
    if picture.record.pose != picture.record.targets[0].pose:
        message = f"the picture's pose is not that of its first target; {MAKE_AGAIN}"
        yield Finding(code="pose", where=picture.where, message=message)
    for target in targets_of(picture):
        length = float(np.linalg.norm(target.T_cam_body.translation))
        if not np.isclose(target.recorded.range, length, rtol=LENGTH, atol=0):
            found = f"the range is {target.recorded.range:.6g} m, and its translation {length:.6g} m long"
            yield target.finding("pose", f"{found}; {MAKE_AGAIN}")
        error = pose_error(target)
        if error and not (error.degrees <= error.allowed_degrees and error.metres <= error.allowed_metres):
            found = f"{error.degrees:.3g} degrees and {1000 * error.metres:.3g} mm from the record's"
            yield target.finding("pose", f"the pose that its dense pose gives is {found}; {MAKE_AGAIN}")


def pose_error(target: CheckedTarget) -> PoseError | None:
    """Return the error of the pose that fits the dense pose best, by OpenCV's Levenberg-Marquardt method from the
    record's pose on; None where the target's pixels do not decide it."""
    dense = target.dense_pose
    if dense is None or len(dense[0]) < MIN_PIXELS:
        return None
    chosen = np.linspace(0, len(dense[0]) - 1, min(SAMPLES, len(dense[0]))).astype(int)
    points, pixels = dense[0][chosen], dense[1][chosen]
    camera, T_cam_body = target.camera, target.T_cam_body
    if camera.fisheye:  # OpenCV solves for the other lens alone
        pixels, camera = camera.pinhole.pixels(camera.normalised(pixels)), camera.pinhole
    lens = camera.matrix, np.array(camera.distortion)
    turn = np.asarray(cv2.Rodrigues(T_cam_body.rotation)[0], np.float64)
    shift = T_cam_body.translation.reshape(3, 1).copy()
    allowed = _allowed(points, turn, shift, lens)
    if allowed is None:
        return None
    found_turn, found_shift = cv2.solvePnPRefineLM(points, pixels, *lens, turn.copy(), shift.copy(), REFINED)
    turned = cv2.Rodrigues(found_turn)[0] @ T_cam_body.rotation.T
    return PoseError(
        degrees=float(np.degrees(_angle(turned))),
        metres=float(np.linalg.norm(found_shift - shift)),
        allowed_degrees=allowed[0],
        allowed_metres=allowed[1],
    )


def _angle(rotation: Float) -> float:
    """Return the angle of a rotation matrix (3, 3), radians, also of the smallest one."""
    axis = [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    return float(np.arctan2(np.linalg.norm(axis), np.trace(rotation) - 1))


def _allowed(points: Float, turn: Float, shift: Float, lens: tuple[Float, Float]) -> tuple[float, float] | None:
    """Return by how many degrees and metres NOISE_PX in the pixels moves the pose that fits them; None for too much."""
    jacobian = np.asarray(cv2.projectPoints(points, turn, shift, *lens)[1][:, :6], np.float64)
    scale = np.linalg.norm(jacobian, axis=0)  # metres and radians differ by orders of magnitude
    singular = np.linalg.svd(jacobian / scale, compute_uv=False)
    if not singular[-1] > 0:
        return None
    spread = NOISE_PX / (singular[-1] * scale)
    degrees, metres = float(np.degrees(np.linalg.norm(spread[:3]))), float(np.linalg.norm(spread[3:]))
    if degrees > MAX_DEGREES:
        return None
    return max(degrees, MIN_DEGREES), max(metres, MIN_METRES)


def box_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield errors for boxes that are not around what mask, pose and dense pose show."""
    for target in targets_of(picture):
        for fault in (*_visible(target), *_truncated(target), *_box_3d(target)):
            yield target.finding("box", f"{fault}; {MAKE_AGAIN}")


def box_of_mask(target: CheckedTarget) -> list[int] | None:
    """Return the tight box x0, y0, x1, y1 of the pixels that show the target; None where none does."""
    assert target.mask is not None
    rows, columns = np.flatnonzero(target.mask.any(1)), np.flatnonzero(target.mask.any(0))
    if not len(rows):
        return None
    return [int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1]


def _visible(target: CheckedTarget) -> Iterator[str]:
    """The visible box is that of the mask, and lies in the amodal one."""
    box = target.recorded.box
    if target.mask is not None and box_of_mask(target) != box.visible:
        yield f"its visible box is {box.visible}, and that of its pixels {box_of_mask(target)}"
    if box.visible and not box.amodal:
        yield "it has a visible box, and no amodal one"
    elif box.visible and box.amodal:
        beyond = np.subtract(box.amodal, box.visible) * (1, 1, -1, -1)
        if not beyond.max() <= CENTRE_PX + ROUNDING_PX:
            yield f"its visible box reaches {beyond.max():.3g} px beyond its amodal one"


def _truncated(target: CheckedTarget) -> Iterator[str]:
    """A target is truncated where its amodal box leaves the frame, or not all of it can be seen by the lens."""
    amodal, truncated = target.recorded.box.amodal, target.recorded.box.truncated
    if amodal is None:
        if not truncated:
            yield "nothing of it is in the picture, and it is said not to be truncated"
        return
    size = (target.camera.width, target.camera.height)
    leaves = max(-min(amodal[:2]), *np.subtract(amodal[2:], size).tolist())
    if leaves > ROUNDING_PX and not truncated:
        yield f"its amodal box leaves the frame by {leaves:.3g} px, and it is said not to be truncated"
    if leaves < -ROUNDING_PX and truncated and None not in target.recorded.box_3d.corners:
        yield "all of it is in the frame, and it is said to be truncated"


def _box_3d(target: CheckedTarget) -> Iterator[str]:
    """The corners are those of the box in metres, which holds the dense pose."""
    low, high = np.array(target.recorded.box_3d.box)
    expected = target.camera.project(target.T_cam_body.points(corners_of_box(low, high)))
    recorded = np.array([corner or (np.nan, np.nan) for corner in target.recorded.box_3d.corners])
    off = _distance(recorded, expected)
    if off:
        yield f"the corners of its 3D box are {off:.3g} px from where its pose puts them"
    dense = target.dense_pose
    if dense and len(dense[0]):
        beyond = float(np.maximum(low - dense[0], dense[0] - high).max())
        if not beyond <= ROUNDING * float(np.abs([low, high]).max()):
            yield f"its dense pose reaches {beyond:.3g} m beyond its 3D box"


def _distance(recorded: Float, expected: Float) -> float:
    """Return how far pixels (N, 2) are apart, infinity where one has none; 0 where rounding makes the difference."""
    known = np.isfinite(expected).all(1)
    if not np.array_equal(known, np.isfinite(recorded).all(1)):
        return float("inf")
    off = np.abs(recorded[known] - expected[known])
    wrong = off > AWAY_PX + AWAY_SHARE * np.abs(expected[known])
    return float(off[wrong].max(initial=0))


def picture_findings(*, dataset: str, record: str) -> PictureAnswer:
    """Return what is wrong with the picture whose record is the file `record` of the dataset."""
    root = Path(dataset)
    try:
        with reading(record):
            content = convert(read_json(Folder(root), record, "record-1"), Record)
    except SpinError as e:
        return PictureAnswer(findings=[_finding("record", record, e)])
    found = dict.fromkeys(_findings(root, record, content))  # numbers that one rule cannot take, others cannot either
    return PictureAnswer(findings=list(found), listed=_listed(content))


def read_arrays(root: Path, files: Mapping[str, RecordedFile]) -> Iterator[tuple[str, NDArray[Any] | Finding]]:
    """Yield the numbers of each of a record's `files` by its kind, or a finding on one that cannot be decoded."""
    for kind, file in files.items():
        try:
            with reading(file.path):
                yield kind, read_picture_file(FileIn(Folder(root), file.path), kind, file.dtype, len(file.channels))
        except SpinError as e:
            yield kind, _finding("unreadable", file.path, e)


def _listed(record: Record) -> ListedPicture:
    return ListedPicture(
        variant=record.variant,
        stage=record.provenance.stage,
        files=[file.path for file in record.files.values()],
        uses=list(uses(record)),
    )


def _findings(root: Path, where: str, record: Record) -> Iterator[Finding]:
    if (record.frame, record.variant) != picture_of(where):
        message = f"its frame and variant differ from its own path; {MAKE_AGAIN}"
        yield Finding(code="record", where=where, message=message)
    wrong = [each for file in record.files.values() for each in digest_findings(root, file.path, file.sha256)]
    found = {} if wrong else dict(read_arrays(root, record.files))
    wrong += [each for each in found.values() if isinstance(each, Finding)]
    yield from wrong
    arrays = {} if wrong else {kind: each for kind, each in found.items() if not isinstance(each, Finding)}
    description = _description(str(root))
    if description is None:  # numbers mean nothing without their targets
        return
    picture = CheckedPicture(where=where, record=record, description=description, arrays=arrays)
    for rule in PICTURE_RULES:
        try:
            with reading(where):
                yield from rule(picture)
        except SpinError as e:
            yield _finding("numbers", where, e)


def _finding(code: str, where: str, error: SpinError) -> Finding:
    return Finding(code=code, where=where, message=f"{error.found}; {MAKE_AGAIN}")


@cache
def _description(root: str) -> DatasetDescription | None:
    """Return dataset.json; None where that cannot be used, which has a finding of its own."""
    with suppress(InputError):
        return read_dataset_json(Folder(Path(root)))
    return None


def target_id_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield an error where the ids of the record's targets, or their names, are not those of dataset.json: the
    picture's labels then mean other targets than the dataset says."""
    there, here = (_names(each.targets) for each in (picture.description, picture.record))
    if there != here:
        found = f"its targets are {_in_words(here)}, but dataset.json has {_in_words(there)}"
        yield Finding(code="target-ids", where=picture.where, message=f"{found}; {MAKE_AGAIN}")


def _names(targets: Iterable[Named]) -> dict[int, str]:
    return {target.id: target.name for target in targets}


def _in_words(names: dict[int, str]) -> str:
    return ", ".join(f"{number} {name!r}" for number, name in sorted(names.items()))


def brightness_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Return a warning for each reason why little of the target shows."""
    return tone_findings(picture.record, picture.where)


PICTURE_RULES: tuple[Callable[[CheckedPicture], Iterator[Finding]], ...] = (
    target_id_findings,
    brightness_findings,
    label_findings,
    pose_findings,
    box_findings,
    count_findings,
    keypoint_findings,
)
"""The rules, in the order in which their findings are reported."""

"""Rule: the pose of each target agrees with its dense pose."""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.commands.check.digests import MAKE_AGAIN
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.checked_target import CheckedTarget, targets_of
from spin_usd.scene.finding import Finding

SAMPLES = 2000  # pixels of a target
MIN_PIXELS = 20  # fewer may lie on a line
NOISE_PX = 1e-3  # tolerance of a pixel's point from its pixel: float32 rounds to less
MIN_DEGREES, MIN_METRES = 1e-5, 1e-7  # where many pixels leave less than rounding in OpenCV
MAX_DEGREES = 1.0  # with a larger tolerance, the target is too small for the rule
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
    """Yield an error for each target whose pose differs by more than rounding, or whose range is not the length of its
    translation, and one if the picture's own pose is not its first target's."""
    if picture.record.pose != picture.record.targets[0].pose:
        message = f"the picture's pose is not its first target's; {MAKE_AGAIN}"
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

"""Refuses a target whose unit is wrong: a size that no spacecraft has, a camera inside it, keypoints far away."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError, NotFramedError
from spin_usd.formats.mesh.mesh_file import MESHES
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.framing import Framing, around, framings
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.scene.derived.view_text import size_text
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.plausible import is_plausible, likely_units
from spin_usd.scene.poses import PoseList

INSISTS = "--any-size insists"


@dataclass(frozen=True, kw_only=True)
class ModelUnit:
    """The unit of the model in `file`."""

    file: Path
    per_metre: float
    """How many of them are a metre."""
    given: bool
    """True if from --units-per-metre."""

    def words(self, per_metre: float) -> str:
        """Return the option or the line of the file that sets the units per metre."""
        if self.given or self.file.suffix.lower() in MESHES:
            return f"--units-per-metre {per_metre:.10g}"
        return f"metersPerUnit = {1 / per_metre:.10g} in {self.file.name}"

    @property
    def said(self) -> str:
        """Beginning of a sentence on the consequence of the unit."""
        if self.given or self.file.suffix.lower() not in MESHES:
            return f"with {self.words(self.per_metre)} "
        return "in the unit of its format or file, "


def refuse_size(corners: Float, unit: ModelUnit) -> None:
    """Raise InputError for a target whose size alone is not plausible; its corners are `corners` (N, 3), metres."""
    size = np.ptp(corners, axis=0)
    if not is_plausible(size):
        raise _implausible(corners, unit, None, None, "")


def refuse_implausible(corners: Float, unit: ModelUnit, camera: Camera, poses: PoseList) -> None:
    """Raise InputError, which names the likely units, for a target with the corners `corners` (N, 3), body frame,
    metres, of a size that no craft has, or inside whose bounding box the camera is in most of the pictures."""
    rotations = matrices_from_quaternions(poses.q_cam_body)
    inside = int(around(corners, rotations, poses.t_cam_body).sum())
    if is_plausible(np.ptp(corners, axis=0)) and 2 * inside <= len(poses):
        return
    among = f", and the camera is inside its bounding box in {inside} of {len(poses)} pictures" if inside else ""
    raise _implausible(corners, unit, camera, poses, among)


def _implausible(
    corners: Float, unit: ModelUnit, camera: Camera | None, poses: PoseList | None, among: str
) -> InputError:
    def fits(scale: float) -> bool:
        """Return whether most pictures would show all of the target if it were larger by that factor."""
        if camera is None or poses is None:
            return True
        rotations = matrices_from_quaternions(poses.q_cam_body)
        framing = framings(camera, corners * scale, rotations, poses.t_cam_body)
        return bool(2 * (framing == Framing.WHOLE).sum() > len(poses))

    size = np.ptp(corners, axis=0)
    meant = _meant(size, unit, fits) or "check the units of the model and of the poses, which are in metres;"
    return InputError(f"{unit.said}the target is {size_text(size)}{among}", where=unit.file, do=f"{meant} {INSISTS}")


def _meant(size: Float, unit: ModelUnit, fits: Callable[[float], bool]) -> str:
    """Return a question that names the likely units, "" if there are none."""
    likely = likely_units(size, unit.per_metre, fits)
    shown = [f"{unit.words(each)} ({size_text(size * unit.per_metre / each)})" for each in likely]
    return f"did you mean {' or '.join(shown)}?" if shown else ""


def not_framed(error: NotFramedError, corners: Float, unit: ModelUnit) -> InputError:
    """Return the error, with the size and the likely units of a target that no craft is as large as; its corners are
    `corners` (N, 3), metres."""
    size = np.ptp(corners, axis=0)
    if is_plausible(size) or not (meant := _meant(size, unit, lambda _: True)):
        return error
    return InputError(f"{error.found}; {unit.said}the target is {size_text(size)}", where=error.where, do=meant)


def notes_on_far_keypoints(keypoints: Keypoints | None, corners: Float) -> tuple[str, ...]:
    """Return a note where keypoints are farther from the bounding box of the `corners` (N, 3), body frame, metres, than
    its diagonal is long."""
    if keypoints is None:
        return ()
    low, high = corners.min(axis=0), corners.max(axis=0)
    away = np.linalg.norm(np.maximum(0, np.maximum(low - keypoints.points, keypoints.points - high)), axis=1)
    far = int(np.count_nonzero(away > np.linalg.norm(high - low)))
    if not far:
        return ()
    name, most = keypoints.names[int(away.argmax())], float(away.max())
    return (
        f"keypoints far off the target: {far} of {len(away)} ({name!r}: {most:.3g} m from its bounding box); "
        "they are in metres, in body axes: check the unit of their file",
    )

"""Predictions matched with the pictures of the truth, and their faults, counted in sentences."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.score.predictions import Prediction
from spin_usd.commands.score.truth import Truth
from spin_usd.errors import InputError
from spin_usd.scoring.keypoint_pose import pose_from_keypoints
from spin_usd.scoring.pose_errors import angles_between

NORM = 1e-3  # off 1 a norm may be by rounding
FAR = np.deg2rad(20)  # of the median attitude, above which another order of its numbers is tried
BETTER = 0.5  # of it: another order that is so much better is reported
CONVENTION = "q_cam_body is scalar first, and takes the body's axes to the camera's"


@dataclass(frozen=True, kw_only=True, eq=False)
class Matched:
    """The predicted poses of pictures in the truth, N of them."""

    places: Sequence[int]
    """(N,): places of the pictures in the truth, in order."""
    q: Float
    """(N, 4), of norm 1."""
    t: Float
    """(N, 3)."""
    missing: int
    """How many pictures of the truth have no prediction."""
    notes: tuple[str, ...]
    """For the user."""


def matched(predictions: Sequence[Prediction], truth: Truth, *, partial: bool) -> Matched:
    """Match predictions with pictures. Raises InputError for a picture that is predicted twice; and where some are
    missing, unusable or of no picture of the truth, unless `partial`."""
    by_place: dict[int, Prediction] = {}
    unknown, twice, useless = [], [], []
    poses: dict[int, Float] = {}
    for each in predictions:
        place = truth.places.get((each.picture, each.variant))
        if place is None:
            unknown.append(each)
        elif place in by_place:
            twice.append(each)
        else:
            by_place[place] = each
            pose = _of_keypoints(each, truth, place) if each.pose is None else each.pose
            if np.isfinite(pose).all() and np.linalg.norm(pose[:4]) > 0:
                poses[place] = pose
            else:
                useless.append(each)
    if twice:
        raise InputError(f"{_counted(twice)} is of a picture that another is of", do="give one for each picture")
    lacking = [truth.names[place] for place in range(len(truth.names)) if place not in by_place]
    faults = []
    if unknown:
        faults.append(f"{_counted(unknown)} is of no picture of the truth")
    if useless:
        faults.append(f"{_counted(useless)} holds NaN, infinity or no rotation, or has too few keypoints")
    if lacking:
        first = _named(lacking[0])
        faults.append(f"{len(lacking)} of {len(truth.names)} pictures have no prediction, the first {first}")
    if faults and not partial:
        raise InputError("; ".join(faults), do="mend the predictions, or score the others with --partial")
    if not poses:
        raise InputError("; ".join(faults), do="check the names: they must be frames, or FRAME-VARIANT")
    places = sorted(poses)
    q, t = np.split(np.array([poses[place] for place in places]), [4], axis=1)
    norms = np.linalg.norm(q, axis=1)
    off, q = np.abs(norms - 1), q / norms[:, None]
    notes = [*faults]
    if (off > NORM).any():
        found = f"{(off > NORM).sum()} of {len(q)} quaternions have another norm than 1"
        notes.append(f"{found} ({norms.min():.3g} to {norms.max():.3g}), and were normalised")
    notes += _other_order(q, truth.q[places])
    return Matched(places=places, q=q, t=t, missing=len(truth.names) - len(places), notes=tuple(notes))


def _of_keypoints(prediction: Prediction, truth: Truth, place: int) -> Float:
    """Return the pose (7,) of the keypoints found; NaN where they give none. Raises InputError where the target has
    others."""
    picture = truth.picture(place)
    if picture is None or truth.target is None:
        raise InputError("keypoints are scored against a dataset, which has their points and the camera", do="give one")
    points = picture.description.targets[truth.target - 1].keypoints.points
    given = prediction.keypoints
    if given is None or len(given) != len(points):
        found = f"has {0 if given is None else len(given)} keypoints, and the target {len(points)}"
        raise InputError(found, where=prediction.where, do="give all of them, with v 0 where one was not found")
    found_ones = np.isfinite(given).all(1) & (given[:, 2] > 0)
    pose = pose_from_keypoints(points[found_ones], given[found_ones, :2], picture.camera)
    return np.full(7, np.nan) if pose is None else np.concatenate(pose)


def _other_order(q: Float, true_q: Float) -> Iterable[str]:
    """Yield which other order of a quaternion's numbers fits the truth far better."""
    median = float(np.median(angles_between(q, true_q)))
    if median < FAR:
        return
    others = {
        "scalar last (x, y, z, w)": q[:, [3, 0, 1, 2]],
        "from the camera's axes to the body's": q * (1, -1, -1, -1),
    }
    for name, other in others.items():
        better = float(np.median(angles_between(other, true_q)))
        if better < BETTER * median:
            said = f"the median attitude error is {np.degrees(median):.3g} degrees; were the quaternions {name}"
            yield f"{said}, it would be {np.degrees(better):.3g}: {CONVENTION}"


def _counted(found: Sequence[Prediction]) -> str:
    return f"{pluralise(len(found), 'prediction')}, the first in {found[0].where},"


def _named(name: tuple[str, str]) -> str:
    return name[0] if not name[1] else f"{name[0]} of {name[1]}"

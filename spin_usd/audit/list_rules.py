"""Rules on a set's lists: numbers, files, classes, boxes, splits and times, without a pixel."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedTarget
from spin_usd.audit.posed_targets import AuditedPicture, AuditedSet, usable
from spin_usd.audit.set_finding import Repair, SetFinding, worst_first
from spin_usd.basics.pluralise import pluralise
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import off_rotation
from spin_usd.scene.finding import WARNING

OFF_NORM = 1e-3  # by which few decimals miss 1
ASIDE = 0.2  # of the picture's width or height, from its middle to the principal point
UNEQUAL = 0.1  # relative difference of fx and fy
VIEW_DEG = (0.3, 150.0)
BEYOND = 2.0  # pixels outside the frame
SHARE = 0.01  # by which a visible share and its counts of pixels may differ


def list_findings(audited: AuditedSet) -> Iterator[SetFinding]:
    """Yield the faults of the lists."""
    for fault in audited.labels.faults:
        remedy = "correct it, or ask the set's authors for a corrected file"
        yield SetFinding(rule=fault.rule, message=fault.message, remedy=remedy, where=fault.where)
    for rule, message, remedy, wrong in TARGET_RULES:
        yield from _of_targets(audited, rule, message, remedy, wrong)
    yield from _cameras(audited)
    yield from _files(audited)
    yield from _classes(audited)
    yield from _splits(audited)
    yield from _times(audited)


def _of_targets(
    audited: AuditedSet,
    rule: str,
    message: str,
    remedy: str,
    wrong: Callable[[AnnotatedPicture, AnnotatedTarget], float],
) -> Iterator[SetFinding]:
    """Yield a finding on the targets for which `wrong` returns more than 0."""
    found = [
        (picture.name, amount)
        for picture in audited.pictures
        for target in picture.labels.targets
        if (amount := wrong(picture.labels, target)) > 0
    ]
    if found:
        pictures = worst_first(found)
        place = next(picture.labels.place for picture in audited.pictures if picture.name == pictures[0])
        message = f"{message}, first in {place}"
        yield SetFinding(rule=rule, message=message, remedy=remedy, pictures=pictures, of=len(audited.pictures))


def _not_numbers(picture: AnnotatedPicture, target: AnnotatedTarget) -> float:
    return float((target.rotation is not None or target.t_cam_body is not None) and not usable(target))


def _norm(picture: AnnotatedPicture, target: AnnotatedTarget) -> float:
    if not usable(target) or target.rotation is None or target.rotation.shape != (4,):
        return 0.0
    off = abs(float(np.linalg.norm(target.rotation)) - 1)
    return off if off > OFF_NORM else 0.0


def _no_rotation(picture: AnnotatedPicture, target: AnnotatedTarget) -> float:
    if not usable(target) or target.rotation is None or target.rotation.shape != (3, 3):
        return 0.0
    off, right_handed = off_rotation(target.rotation)
    return 2 + off if not right_handed else off if off > OFF_NORM else 0.0


def _behind(picture: AnnotatedPicture, target: AnnotatedTarget) -> float:
    return max(0.0, -float(target.t_cam_body[2]) + 1e-12) if usable(target) and target.t_cam_body is not None else 0.0


def _no_box(picture: AnnotatedPicture, target: AnnotatedTarget) -> float:
    box = target.box
    return float(box is not None and not (np.isfinite(box).all() and (box[2:] > box[:2]).all()))


def _size(picture: AnnotatedPicture) -> tuple[int, int] | None:
    camera = picture.camera
    return (camera.width, camera.height) if camera else picture.said_size


def _box_outside(picture: AnnotatedPicture, target: AnnotatedTarget) -> float:
    box, size = target.box, _size(picture)
    if box is None or size is None or _no_box(picture, target):
        return 0.0
    outside = float(max(-box[:2].min(), (box[2:] - size).max()))
    return outside if outside > BEYOND else 0.0


def _visible_share(picture: AnnotatedPicture, target: AnnotatedTarget) -> float:
    share, pixels, whole = target.visible, target.pixels, target.whole
    if share is None:
        return 0.0
    counted = pixels / whole if pixels is not None and whole else share
    return float(not 0 <= share <= 1 or abs(share - counted) > SHARE)


def _keypoint_flags(picture: AnnotatedPicture, target: AnnotatedTarget) -> float:
    points = target.keypoints
    return float(points is not None and not np.isin(points[:, 2], (0, 1, 2)).all())


def _keypoint_outside(picture: AnnotatedPicture, target: AnnotatedTarget) -> float:
    points, size = target.keypoints, _size(picture)
    if points is None or size is None:
        return 0.0
    seen = points[points[:, 2] > 1, :2]
    outside = max(float(-seen.min(initial=0)), float((seen - size).max(initial=0)))
    return outside if outside > BEYOND else 0.0


CORRECT = "correct the list, or leave these pictures out"
TARGET_RULES = (
    ("pose-numbers", "a pose has values that are not finite numbers", CORRECT, _not_numbers),
    ("quaternion-norm", "a quaternion is not of length 1", "normalise it if its direction is right", _norm),
    ("rotation-matrix", "a matrix is not a rotation, or is left-handed", CORRECT, _no_rotation),
    ("behind-camera", "the target lies behind the camera", "check the axes of the camera and the direction", _behind),
    ("box-empty", "a box has no area, or values that are not numbers", CORRECT, _no_box),
    ("box-outside", "a box reaches out of the frame", "clip it, or check its order and unit", _box_outside),
    ("visible-share", "a visible share is not from 0 to 1, or not that of the listed pixels", CORRECT, _visible_share),
    ("keypoint-flags", "a keypoint's visibility is none of 0, 1 and 2", CORRECT, _keypoint_flags),
    ("keypoint-outside", "a visible keypoint lies outside the frame", CORRECT, _keypoint_outside),
)
"""Rules on one target's numbers: name, meaning, remedy, and how wrong it is, 0 if it is right."""


def _cameras(audited: AuditedSet) -> Iterator[SetFinding]:
    """Yield faults of each camera's numbers."""
    users: dict[Camera, list[str]] = defaultdict(list)
    for picture in audited.pictures:
        if picture.labels.camera is not None:
            users[picture.labels.camera].append(picture.name)
    for camera, names in users.items():
        aside = max(abs(camera.cx / camera.width - 0.5), abs(camera.cy / camera.height - 0.5))
        unequal = abs(camera.fx / camera.fy - 1)
        view = float(np.degrees(2 * np.arctan(camera.width / 2 / camera.fx)))
        said = [
            (aside > ASIDE, f"the principal point ({camera.cx:.6g}, {camera.cy:.6g}) is far from the middle"),
            (unequal > UNEQUAL, f"fx is {camera.fx:.6g} and fy {camera.fy:.6g}"),
            (not VIEW_DEG[0] <= view <= VIEW_DEG[1] and not camera.fisheye, f"the field of view is {view:.3g} degrees"),
        ]
        for wrong, message in said:
            if wrong:
                size = f"for pictures of {camera.width} x {camera.height} pixels {message}"
                remedy = "check that K is of this size of pictures, in pixels"
                yield SetFinding(
                    rule="camera-matrix", message=size, remedy=remedy, pictures=names, of=len(audited.pictures)
                )


def _files(audited: AuditedSet) -> Iterator[SetFinding]:
    pictures = audited.pictures
    lost = [picture.name for picture in pictures if not picture.labels.exists]
    if lost:
        remedy = "check the names and their endings, or download the set again"
        message = "a list names an image that is not there"
        yield SetFinding(rule="image-lost", message=message, remedy=remedy, pictures=lost, of=len(pictures))
    if renamed := audited.labels.renamed:
        said, file = next(iter(renamed.items()))
        message = f"{len(renamed)} images, such as {said}, lie elsewhere or are spelled otherwise: {file}"
        remedy = "correct the lists: spin-usd check SET --repair-to FOLDER writes such a copy"
        yield SetFinding(
            rule="image-name",
            message=message,
            remedy=remedy,
            where=file,
            severity=WARNING,
            repair=Repair(names=renamed),
        )
    if beside := audited.labels.unlabelled:
        message = f"{len(beside)} images, such as {beside[0]}, are in no list"
        yield SetFinding(
            rule="unlabelled", message=message, remedy="label them, or remove them", where=beside[0], severity=WARNING
        )
    counts = Counter((picture.name, picture.labels.split) for picture in pictures)
    empty = [picture.name for picture in pictures if not picture.labels.targets]
    if empty and len(empty) < len(pictures):
        message, remedy = "an image has no labels", "none if it shows no target; else label it"
        yield SetFinding(
            rule="unannotated", message=message, remedy=remedy, pictures=empty, of=len(pictures), severity=WARNING
        )
    doubled = [picture.name for picture in pictures if _repeats(picture.labels.targets)]
    if doubled:
        message = "a target has the same labels twice in one image"
        yield SetFinding(rule="listed-twice", message=message, remedy=CORRECT, pictures=doubled, of=len(pictures))
    if twice := [name for (name, _), count in counts.items() if count > 1]:
        message = "an image is listed more than once in one split"
        yield SetFinding(rule="listed-twice", message=message, remedy=CORRECT, pictures=twice, of=len(pictures))


def _repeats(targets: Sequence[AnnotatedTarget]) -> bool:
    boxes = [(target.id, target.box.tobytes()) for target in targets if target.box is not None]
    return len(set(boxes)) < len(boxes)


def _classes(audited: AuditedSet) -> Iterator[SetFinding]:
    known = audited.labels.classes
    found = [(p.name, t.id) for p in audited.pictures for t in p.labels.targets if known and t.id not in known]
    if found:
        classes = pluralise(len(known), "class", "classes")
        message = f"a class, such as {found[0][1]!r}, is not in the list of {classes}"
        wrong = list(dict.fromkeys(name for name, _ in found))
        yield SetFinding(
            rule="class-unknown", message=message, remedy=CORRECT, pictures=wrong, of=len(audited.pictures)
        )
    ids = {t.id for p in audited.pictures for t in p.labels.targets}
    spelled: dict[str, list[str]] = defaultdict(list)
    for name in sorted(ids):
        spelled["".join(filter(str.isalnum, name.lower()))].append(name)
    for alike in spelled.values():
        if len(alike) > 1 and not all(map(str.isdecimal, alike)):
            message = f"the classes {' and '.join(map(repr, alike))} differ in spelling alone"
            yield SetFinding(rule="class-spelling", message=message, remedy="use one of them", severity=WARNING)


def _splits(audited: AuditedSet) -> Iterator[SetFinding]:
    """Yield images, and poses, that two splits share."""
    by_image: dict[str, set[str]] = defaultdict(set)
    by_pose: dict[bytes, set[str]] = defaultdict(set)
    first: dict[bytes, str] = {}
    for picture in audited.pictures:
        by_image[picture.name].add(picture.labels.split)
        if (pose := _pose(picture)) is not None:
            by_pose[pose].add(picture.labels.split)
            first.setdefault(pose, picture.name)
    shared = [name for name, splits in by_image.items() if len(splits) > 1]
    remedy = "leave them out of all splits but one: a test must not know what was learned"
    if shared:
        message = f"an image is in the splits {' and '.join(sorted(by_image[shared[0]]))}"
        yield SetFinding(rule="split-overlap", message=message, remedy=remedy, pictures=shared, of=len(by_image))
    poses = [first[pose] for pose, splits in by_pose.items() if len(splits) > 1]
    if poses and not shared:
        message = "exactly the same pose is in two splits"
        yield SetFinding(
            rule="split-overlap", message=message, remedy=remedy, pictures=poses, of=len(by_image), severity=WARNING
        )


def _pose(picture: AuditedPicture) -> bytes | None:
    posed = [target for target in picture.labels.targets if usable(target)]
    numbers = [part for each in posed for part in (each.rotation, each.t_cam_body) if part is not None]
    return b"".join(np.asarray(part).tobytes() for part in numbers) or None


def _times(audited: AuditedSet) -> Iterator[SetFinding]:
    last: dict[str, float] = {}
    back, none, timed = [], [], 0
    for picture in audited.pictures:
        time, sequence = picture.labels.time, picture.labels.sequence
        if time is None:
            continue
        timed += 1
        if not np.isfinite(time):
            none.append(picture.name)
            continue
        if time <= last.get(sequence, -np.inf):
            back.append(picture.name)
        last[sequence] = time
    for message, names in (("a time is not later than the one before", back), ("a time is not readable", none)):
        if names:
            yield SetFinding(rule="time-order", message=message, remedy="sort by time", pictures=names, of=timed)

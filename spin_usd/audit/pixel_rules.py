"""Rules on a set's images, masks and depth beside its lists."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from spin_usd.audit.annotated_set import AnnotatedTarget
from spin_usd.audit.picture_measures import PictureMeasures, TargetMeasures
from spin_usd.audit.posed_targets import AuditedPicture, AuditedSet, usable
from spin_usd.audit.set_finding import SetFinding, worst_first
from spin_usd.basics.arrays import Float
from spin_usd.scene.finding import ERROR, WARNING

SAME_BOX = 0.85  # overlap (IoU) of a box and its mask's
ROUNDED = 2.0  # pixels by which the sides of a box and its mask's may differ
COUNT = 0.02  # relative difference of counts of pixels
FEW = 20  # pixels
MORE = 0.25  # share of the lit pixels by which the mirrored label holds more of them
MOST = 0.5  # share of the pictures that make a fault one of the set
WITHOUT_DEPTH = 0.1  # share of a mask
BESIDE_MASK = 0.3  # share of the pixels with depth
GREY = (0.002, 0.9)  # share of a mask's pixels that are neither black nor white
AGAIN = "download or export these files again"
CORRECT = "correct the labels, or leave these pictures out"
REMOVE = "keep one of each"


def pixel_findings(audited: AuditedSet) -> Iterator[SetFinding]:
    """Yield the faults that files show."""
    read = [picture for picture in audited.pictures if picture.measures]
    yield from _unreadable(read)
    yield from _sizes(read)
    yield from _duplicates(read)
    yield from _encoding(read)
    yield from _boxes(read)
    yield from _mirrored(read)
    yield from _masks_and_depth(audited, read)


def _measured(read: Sequence[AuditedPicture]) -> Iterator[tuple[str, AnnotatedTarget, TargetMeasures]]:
    for picture in read:
        for target, measures in picture.targets():
            if measures is not None:
                yield picture.name, target, measures


def _finding(
    rule: str, message: str, remedy: str, names: Sequence[str], of: int, severity: str = ERROR
) -> Iterator[SetFinding]:
    if names:
        yield SetFinding(rule=rule, message=message, remedy=remedy, pictures=names, of=of, severity=severity)


def _measures(picture: AuditedPicture) -> PictureMeasures:
    assert picture.measures is not None
    return picture.measures


def _unreadable(read: Sequence[AuditedPicture]) -> Iterator[SetFinding]:
    by_reason: dict[str, list[str]] = defaultdict(list)
    for picture in read:
        for file, why in _measures(picture).errors.items():
            by_reason[why].append(file)
    for why, files in by_reason.items():
        yield SetFinding(rule="unreadable", message=why, remedy=AGAIN, pictures=files, of=len(read))


def _sizes(read: Sequence[AuditedPicture]) -> Iterator[SetFinding]:
    off, masks = defaultdict[tuple[int, int, int, int], list[str]](list), []
    for picture in read:
        camera, size = picture.labels.camera, _measures(picture).size
        said = (camera.width, camera.height) if camera else picture.labels.said_size
        if size and said and size != said and 0 not in said:
            off[*said, *size].append(picture.name)
        if _measures(picture).mask_size:
            masks.append(picture.name)
    for (w, h, width, height), names in off.items():
        message = f"an image has {width} x {height} pixels where the camera or the list has {w} x {h}"
        remedy = f"multiply K by {width / w:.6g}" if width * h == height * w else "check which pictures K is of"
        yield from _finding("image-size", message, remedy, names, len(read))
    message = "a mask or depth has another size than its image"
    yield from _finding("label-size", message, CORRECT, masks, len(read))


def _duplicates(read: Sequence[AuditedPicture]) -> Iterator[SetFinding]:
    for key, what in (("sha256", "the bytes of another"), ("look", "the looks of another under another pose")):
        groups: dict[str, list[AuditedPicture]] = defaultdict(list)
        for picture in {picture.name: picture for picture in read}.values():
            if value := getattr(_measures(picture), key):
                groups[value].append(picture)
        same = [group for group in groups.values() if len(group) > 1]
        across = [g for g in same if len({p.labels.split for p in g}) > 1]
        posed = [g for g in same if g not in across and _poses_differ(g)]
        rest = [g for g in same if g not in across and g not in posed] if key == "sha256" else []
        if key == "look":
            across = [g for g in across if _poses_differ(g)]
            posed, across = [g for g in (*posed, *across) if len({_measures(p).sha256 for p in g}) > 1], []
        told: tuple[tuple[str, list[list[AuditedPicture]], str, str], ...] = (
            ("split-overlap", across, f"an image has {what} in another split", ERROR),
            ("duplicate", posed, f"an image has {what}" + ", under another pose" * (key == "sha256"), ERROR),
            ("duplicate", rest, f"an image has {what}", WARNING),
        )
        for rule, found, message, severity in told:
            severity = WARNING if key == "look" else severity
            names = [picture.name for group in found for picture in group]
            yield from _finding(rule, message, REMOVE, names, len(read), severity)


def _poses_differ(group: Sequence[AuditedPicture]) -> bool:
    poses = []
    for picture in group:
        posed = [target for target in picture.labels.targets if usable(target)]
        if not posed or posed[0].rotation is None or posed[0].t_cam_body is None:
            return False
        poses.append(np.concatenate([posed[0].rotation.ravel(), posed[0].t_cam_body]))
    return len({pose.shape for pose in poses}) == 1 and bool(np.ptp(np.array(poses), axis=0).max() > 0.02)


def _encoding(read: Sequence[AuditedPicture]) -> Iterator[SetFinding]:
    equal = [picture.name for picture in read if _measures(picture).equal_channels]
    colour = sum(_measures(picture).equal_channels is False for picture in read)
    message = "the three channels of an image are equal" + (" though others of the set are in colour" if colour else "")
    remedy = "give it its colours, or one channel" if colour else "none if intended: one channel is a third of the size"
    yield from _finding("equal-channels", message, remedy, equal, len(read), WARNING)
    twice = [picture.name for picture in read if _measures(picture).twice_encoded]
    message = "an image's values have the gaps of an sRGB curve that was applied to 8-bit values"
    yield from _finding("encoded-twice", message, "encode the linear image once", twice, len(read))


def overlap(a: Float, b: Float) -> float:
    """Return the overlap (IoU) of two boxes x0, y0, x1, y1."""
    both = np.prod(np.maximum(np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]), 0))
    return float(both / max(np.prod(a[2:] - a[:2]) + np.prod(b[2:] - b[:2]) - both, 1e-12))


def _boxes(read: Sequence[AuditedPicture]) -> Iterator[SetFinding]:
    """Yield boxes that disagree with masks, or with what is lit, and the order of numbers that agrees."""
    pairs = []
    for picture in read:
        for target, measures in picture.targets():
            seen, exact = (measures.box, True) if measures and measures.box else (_measures(picture).lit_box, False)
            alone = len(picture.labels.targets) == 1
            if target.box is not None and seen is not None and np.isfinite(target.box).all() and (exact or alone):
                pairs.append((picture.name, target.box, np.array(seen), exact))
    bad = [(name, box, seen) for name, box, seen, exact in pairs if _disagree(box, seen, exact)]
    if not bad:
        return
    wrong = worst_first((name, 1 - overlap(box, seen)) for name, box, seen in bad)
    for reading, change in BOX_READINGS.items():
        right = sum(not _disagree(change(box), seen, exact) for _, box, seen, exact in pairs)
        if len(bad) > MOST * len(pairs) and right > 0.7 * len(pairs):
            message = f"boxes agree with the pixels if their numbers are read as {reading}"
            yield from _finding("box-order", message, f"read or write them as {reading}", wrong, len(pairs))
            return
    message = "a box is not where the target's pixels are"
    yield from _finding("box-mask", message, CORRECT, wrong, len(pairs))


def _disagree(box: Float, seen: Float, exact: bool) -> bool:
    if not (box[2:] > box[:2]).all():
        return True
    near = bool(np.abs(box - seen).max() <= ROUNDED)
    return not near and overlap(box, seen) < (SAME_BOX if exact else 0.02)


def _middle(box: Float) -> Float:
    size = box[2:] - box[:2]
    return np.concatenate([box[:2] - size / 2, box[:2] + size / 2])


BOX_READINGS = {
    "rows before columns": lambda box: box[[1, 0, 3, 2]],
    "x0, y0, x1, y1 in place of x, y, width, height": lambda box: np.array([*box[:2], *(box[2:] - box[:2])]),
    "x, y, width, height in place of x0, y0, x1, y1": lambda box: np.array([*box[:2], *(box[:2] + box[2:])]),
    "the middle, width and height in place of a corner, width and height": _middle,
}


def _mirrored(read: Sequence[AuditedPicture]) -> Iterator[SetFinding]:
    """Yield labels that hold more of what is lit when they are mirrored."""
    lit = [(name, each.lit) for name, _, each in _measured(read) if each.lit is not None]
    for place, how in ((1, "left to right"), (2, "upside down")):
        index: Literal[1, 2] = 1 if place == 1 else 2
        found = [(name, of[index] - of[0]) for name, of in lit if of[index] > of[0] + MORE and of[0] < 0.5]
        if not found:
            continue
        apart = sum(of[0] > of[index] + MORE for _, of in lit)
        all_of_them = len(found) > MOST * (len(found) + apart)
        which = "the set's labels are" if all_of_them else "a picture, or its label, is"
        message = f"{which} mirrored {how}: what is lit lies inside the mirrored label"
        remedy = "mirror the labels, or the images" if all_of_them else CORRECT
        yield from _finding("mirrored", message, remedy, worst_first(found), len(lit))


def _masks_and_depth(audited: AuditedSet, read: Sequence[AuditedPicture]) -> Iterator[SetFinding]:
    rows = list(_measured(read))
    masked = [row for row in rows if row[1].mask is not None]
    empty = [name for name, target, each in masked if not each.pixels and target.box is not None]
    yield from _finding("mask-empty", "a mask is empty where there is a box", CORRECT, empty, len(masked))
    counts = [
        (name, abs(each.pixels - target.pixels) / max(target.pixels, 1))
        for name, target, each in masked
        if target.pixels is not None and each.pixels and abs(each.pixels - target.pixels) > FEW + COUNT * target.pixels
    ]
    message = "the number of a mask's pixels is not the listed one"
    yield from _finding("mask-pixels", message, CORRECT, worst_first(counts), len(masked))
    stepped = [] if audited.labels.masks_are_lossy else masked
    grey = [(name, each.grey) for name, _, each in stepped if GREY[0] < each.grey < GREY[1]]
    message = "a mask holds values between black and white, as resizing or JPEG leave them"
    yield from _finding("mask-grey", message, "threshold it", worst_first(grey), len(masked), WARNING)
    holes = [(name, each.without_depth) for name, _, each in masked if each.without_depth > WITHOUT_DEPTH]
    message = "depth is missing inside a mask"
    yield from _finding("depth-mask", message, CORRECT, worst_first(holes), len(masked))
    beside = [(name, each.beside_mask) for name, _, each in masked if each.beside_mask > BESIDE_MASK]
    message = "depth lies beside the only mask"
    yield from _finding("depth-mask", message, CORRECT, worst_first(beside), len(masked), WARNING)

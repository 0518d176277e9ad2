"""Rules on a set's images, masks and depth beside its lists."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from scipy.spatial import KDTree

from spin_usd.audit.annotated_set import AnnotatedTarget
from spin_usd.audit.picture_measures import PictureMeasures, TargetMeasures
from spin_usd.audit.posed_targets import AuditedPicture, AuditedSet, usable
from spin_usd.audit.set_finding import SetFinding, worst_first
from spin_usd.basics.arrays import Float
from spin_usd.scene.finding import ERROR, WARNING

SAME_BOX = 0.85  # overlap (IoU) of a box and its mask's
LIT_INSIDE = 0.3  # share of the box of the lit pixels that lies in the target's
FAR = 1e9  # pixels, beyond which a number is none of a box
LIT_BOX = 0.5  # overlap (IoU) of a box and that of the lit pixels, at least
BETTER = 0.2  # of overlap by which another order of numbers must agree better
WINS = 0.7  # share of the pictures in which it must
ROUNDED = 2.0  # pixels by which the sides of a box and its mask's may differ
COUNT = 0.02  # relative difference of counts of pixels
FEW = 20  # pixels
ALIKE = 1.5  # steps of 8 bits between the fields of two pictures of the same looks
AXES = 10  # of fields, mixed, by which pictures are searched
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
    boxes = list(_boxes(read))
    yield from boxes
    yield from _mirrored(read, masks_alone=bool(boxes))
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
    pictures = list({picture.name: picture for picture in read}.values())
    groups: dict[str, list[AuditedPicture]] = defaultdict(list)
    for picture in pictures:
        shows = _measures(picture).lit_box or _measures(picture).look  # black pictures are all the same
        if (digest := _measures(picture).sha256) and shows:
            groups[digest].append(picture)
    same = [group for group in groups.values() if len(group) > 1]
    across = [group for group in same if len({picture.labels.split for picture in group}) > 1]
    posed = [group for group in same if group not in across and _poses_differ(group)]
    rest = [group for group in same if group not in across and group not in posed]
    told = (
        ("split-overlap", across, "an image has the bytes of another in another split", ERROR),
        ("duplicate", posed, "an image has the bytes of another, under another pose", ERROR),
        ("duplicate", rest, "an image has the bytes of another", WARNING),
    )
    for rule, found, message, severity in told:
        names = [picture.name for group in found for picture in group]
        yield from _finding(rule, message, REMOVE, names, len(read), severity)
    alike = [pair for pair in _alike(pictures) if _poses_differ(pair)]
    names = list(dict.fromkeys(picture.name for pair in alike for picture in pair))
    yield from _finding(
        "duplicate", "an image looks like another under another pose", REMOVE, names, len(read), WARNING
    )


def _alike(pictures: Sequence[AuditedPicture]) -> list[tuple[AuditedPicture, AuditedPicture]]:
    """Return pairs of pictures of nearly the same looks and of different bytes."""
    seen = [picture for picture in pictures if _measures(picture).look]
    if len(seen) < 2:
        return []
    looks = np.array([list(bytes.fromhex(_measures(picture).look)) for picture in seen], np.float64)
    axes = np.linalg.qr(np.random.default_rng(0).normal(size=(looks.shape[1], AXES)))[0]
    near = KDTree(looks @ axes).query_pairs(ALIKE * np.sqrt(looks.shape[1]))
    return [
        (seen[a], seen[b])
        for a, b in sorted(near)
        if np.abs(looks[a] - looks[b]).max() <= ALIKE and _measures(seen[a]).sha256 != _measures(seen[b]).sha256
    ]


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
            if target.box is not None and seen is not None and np.abs(target.box).max() < FAR and (exact or alone):
                size = np.array(_measures(picture).size or (1, 1), np.float64)
                pairs.append((picture.name, target.box, np.array(seen), exact, size))
    bad = [(name, box, seen) for name, box, seen, exact, _ in pairs if _disagree(box, seen, exact)]
    if reading := _other_order(pairs):
        wrong = worst_first((name, 1 - overlap(box, seen)) for name, box, seen, _, _ in pairs)
        message = f"boxes agree with the pixels if their numbers are read as {reading}"
        yield from _finding("box-order", message, f"read or write them as {reading}", wrong, len(pairs))
        return
    wrong = worst_first((name, 1 - overlap(box, seen)) for name, box, seen in bad)
    message = "a box is not where the target's pixels are"
    yield from _finding("box-mask", message, CORRECT, wrong, len(pairs))


def _other_order(pairs: Sequence[tuple[str, Float, Float, bool, Float]]) -> str:
    """Return the order of numbers in which boxes overlap clearly more with the pixels; "" if there is none. Of a target
    without a mask these are its lit pixels, a part of it."""
    own = np.array([overlap(box, seen) for _, box, seen, _, _ in pairs])
    best, most = "", max(LIT_BOX, float(np.median(own)) + BETTER) if pairs else 1.0
    for reading, change in BOX_READINGS.items():
        other = np.array([overlap(change(box, size), seen) for _, box, seen, _, size in pairs])
        if pairs and np.median(other) > most and np.mean(other > own) > WINS:
            best, most = reading, float(np.median(other))
    return best


def _disagree(box: Float, seen: Float, exact: bool) -> bool:
    if not (box[2:] > box[:2]).all():
        return True
    if not exact:  # what is lit is a part of the target
        near = box + np.array([-ROUNDED, -ROUNDED, ROUNDED, ROUNDED])
        both = np.prod(np.maximum(np.minimum(near[2:], seen[2:]) - np.maximum(near[:2], seen[:2]), 0))
        return bool(both < LIT_INSIDE * np.prod(seen[2:] - seen[:2]))
    return bool(np.abs(box - seen).max() > ROUNDED) and overlap(box, seen) < SAME_BOX


def _transposed(box: Float, size: Float) -> Float:
    """Return the box whose shares of the picture's sides were exchanged."""
    return np.asarray((box / np.tile(size, 2))[[1, 0, 3, 2]] * np.tile(size, 2))


def _ends(box: Float, size: Float) -> Float:
    """Return the box whose ends were read as middle, width and height."""
    return np.concatenate([(box[:2] + box[2:]) / 2, box[2:] - box[:2]])


BOX_READINGS: Mapping[str, Callable[[Float, Float], Float]] = {
    "rows before columns": lambda box, size: box[[1, 0, 3, 2]],
    "rows before columns, in shares": _transposed,
    "x0, y0, x1, y1 in place of x, y, width, height": lambda box, size: np.array([*box[:2], *(box[2:] - box[:2])]),
    "x, y, width, height in place of x0, y0, x1, y1": lambda box, size: np.array([*box[:2], *(box[:2] + box[2:])]),
    "the middle in place of a corner": lambda box, size: box - np.tile(box[2:] - box[:2], 2) / 2,
    "a corner in place of the middle": lambda box, size: box + np.tile(box[2:] - box[:2], 2) / 2,
    "x0, y0, x1, y1 in place of the middle, width and height": _ends,
}
"""Orders of a box's numbers, and the box x0, y0, x1, y1 that one read wrongly really is, in a picture of a size."""


def _mirrored(read: Sequence[AuditedPicture], *, masks_alone: bool) -> Iterator[SetFinding]:
    """Yield labels that hold more of what is lit when they are mirrored. masks_alone: boxes are wrong otherwise."""
    rows = [(name, target, each.lit) for name, target, each in _measured(read)]
    lit = [(name, of) for name, target, of in rows if of is not None and not (masks_alone and target.mask is None)]
    hidden = [name for name, of in lit if max(of) > of[0] + MORE and of[0] < 0.5]
    for index, how in enumerate(("mirrored left to right", "mirrored upside down", "turned by 180 degrees"), 1):
        found = [(name, of[index] - of[0]) for name, of in lit if name in hidden and of[index] == max(of)]
        if not found:
            continue
        apart = sum(of[0] > of[index] + MORE for _, of in lit)
        all_of_them = len(found) > MOST * (len(found) + apart)
        which = "most labels are" if all_of_them else "a picture, or its label, is"
        message = f"{which} {how}: what is lit lies inside the label {how}"
        remedy = "turn the labels, or the images, back" if all_of_them else CORRECT
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

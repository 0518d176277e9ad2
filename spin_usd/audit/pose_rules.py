"""Rules on a set's poses beside its labels in the image: reading of rotations, distances, keypoints, depth, model."""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spin_usd.audit.posed_targets import AuditedSet, PosedTargets
from spin_usd.audit.readings import (
    FEWEST,
    MOST,
    Fit,
    Outlines,
    Reading,
    by_boxes,
    by_keypoints,
    by_outlines,
    readings,
    turned_enough,
)
from spin_usd.audit.set_finding import Repair, SetFinding, worst_first
from spin_usd.basics.arrays import Float
from spin_usd.scene.finding import ERROR, WARNING

BETTER = 0.05  # of overlap (IoU) by which another reading must agree better
GOOD = 0.75  # overlap (IoU) of a reading that agrees
FOLLOWED, CHANCE = 0.66, 0.57  # mean rank of edges under outlines that follow them, and that do not
STRANGE = 0.5  # overlap (IoU) that poses of other pictures reach at most
FOLLOWING = 0.4  # correlation of what is lit with the body's origin, which poses of other pictures do not reach
WINS = 0.75  # share of the pictures in which it must agree better
CLEARLY = 5.0  # ratio of errors of keypoints
PIXELS = 2.0  # error of keypoints, above which labels are not merely rounded
OUTLIER = 0.62  # overlap (IoU) with the body that the other pictures leave; 0.7 is the least of right ones
APART = 4.0  # pixels between the sides of two boxes that are not merely of rounded pixels
SHIFT = (0.35, 0.65)  # pixels, of a half
POWERS = (1e-3, 1e-2, 0.1, 0.3048, 10.0, 100.0, 1e3)
UNITS = {1e-3: "metres read as if they were millimetres", 10.0: "decimetres", 100.0: "centimetres", 1e3: "millimetres"}
ASLANT = 0.75  # of a body's diagonal, its box's diagonal in the image seen from a usual side
MOST_LISTS = 6  # whose readings are compared: each takes half a second
OFF = 2.5  # ratio beyond which a distance is wrong rather than the craft seen from its narrow side
SIZES_M = (0.03, 200.0)  # of craft
NO_OUTLINES: Mapping[str, Outlines] = {}
CORRECT = "correct the pose, or leave these pictures out"


def pose_findings(
    audited: AuditedSet, models: Mapping[str, Float], outlines: Mapping[str, Outlines] = NO_OUTLINES
) -> Iterator[SetFinding]:
    """Yield the faults of poses. `models`: points (M, 3) of the targets' models, metres, by id; "" for all others.
    `outlines`: of targets without masks and boxes, by id."""
    for key, targets in audited.posed.items():
        model = models.get(key, models.get(""))
        found = _of_lists(targets, model) if key not in outlines else []
        reading = Reading()
        if not found:
            reading, found = _reading(targets, model, outlines.get(key))
        yield from found
        if not found and key in outlines:
            yield from _edges(outlines[key])
        if not found:
            yield from _outliers(targets, reading, model)
            yield from _distances(targets, model)
        yield from _silhouettes(targets)


def _of_lists(targets: PosedTargets, model: Float | None) -> list[SetFinding]:
    """Return findings on single lists whose poses have another reading than those of the others."""
    places: dict[str, list[int]] = defaultdict(list)
    for place, (picture, *_) in enumerate(targets.rows):
        places[picture.labels.list].append(place)
    if not 1 < len(places) <= MOST_LISTS or min(map(len, places.values())) < FEWEST:
        return []
    found, own = [], 0
    for name, own_places in places.items():
        reading, findings = _reading(targets.at(own_places), model, None)
        own += reading == Reading()
        found += [
            replace(
                each,
                message=f"in {name} alone {each.message}",
                repair=each.repair and replace(each.repair, lists=frozenset({name})),
            )
            for each in findings
            if reading != Reading()
        ]
    return found if own else []


def _reading(targets: PosedTargets, model: Float | None, outlines: Outlines | None) -> tuple[Reading, list[SetFinding]]:
    """Return the reading of poses that agrees best, and a finding if it is not the layout's own."""
    own = Reading()
    if len(targets) < FEWEST or not turned_enough(targets):
        return own, []
    some = targets.some(MOST)
    keypoints = _by_keypoints(some)
    best, why = keypoints or (_by_outlines(outlines) if outlines else _by_boxes(some, model)) or (own, "")
    if best == own:
        return own, list(_strangers(some)) if keypoints is None and outlines is None else []
    rule = "mirrored" if best.mirrored and best == Reading(mirrored=best.mirrored) else "pose-reading"
    remedy = "spin-usd check SET --repair-to FOLDER writes a copy that is read rightly"
    repair = None if best.mirrored or (best.of_camera and targets.labels.other_axes) else Repair(reading=best)
    if repair is None:
        remedy = "mirror the labels, or the images" if best.mirrored else "convert the positions"
    return best, [
        SetFinding(
            rule=rule,
            message=f"labels or images are {best.name.removeprefix('labels ')} ({why})"
            if rule == "mirrored"
            else f"poses agree with labels if they are read as {best.name} ({why})",
            remedy=remedy,
            pictures=targets.names,
            of=len(targets),
            repair=repair,
        )
    ]


def _by_keypoints(targets: PosedTargets) -> tuple[Reading, str] | None:
    """Return the reading in which keypoints agree; None where there are too few to say."""
    own = by_keypoints(targets, Reading())
    if own is None:
        return None
    if -own.score < PIXELS:
        return own.reading, ""
    fits = [fit for reading in readings(targets) if (fit := by_keypoints(targets, reading))]
    best = max(fits, key=lambda fit: fit.score)
    if best.score * CLEARLY > own.score:
        return best.reading, f"keypoints are {-best.score:.2g} px off, and {-own.score:.3g} px as the layout has it"
    return None


def _by_boxes(targets: PosedTargets, model: Float | None) -> tuple[Reading, str] | None:
    own = by_boxes(targets, Reading(), model)
    others = [by_boxes(targets, reading, model) for reading in readings(targets)]
    best = max(others, key=lambda fit: fit.score)
    both = np.isfinite(own.each) & np.isfinite(best.each)
    if not both.any() or best.score < GOOD or best.score < own.score + BETTER:
        return None
    if np.mean(best.each[both] > own.each[both]) < WINS:
        return None
    return best.reading, f"boxes overlap by {best.score:.2f}, and by {own.score:.2f} as the layout has it"


def _by_outlines(outlines: Outlines) -> tuple[Reading, str] | None:
    own, *others = by_outlines(outlines)
    best = max(others, key=lambda fit: fit.score)
    if best.score < FOLLOWED or best.score < own.score + BETTER or np.nanmean(best.each > own.each) < WINS:
        return None
    return best.reading, f"outlines follow edges by {best.score:.2f}, and by {own.score:.2f} as the layout has it"


def _edges(outlines: Outlines) -> Iterator[SetFinding]:
    """Yield pictures in which the model's outline follows no edges though it does in most, or in none."""
    own = by_outlines(outlines)[0]
    lost = own.each < CHANCE
    if own.score > FOLLOWED and lost.any():
        message = "the model's outline follows no edges where the pose puts it"
        yield _finding("pose-image", message, CORRECT, outlines.targets, np.flatnonzero(lost), 1 - own.each)
    elif own.score < CHANCE and len(outlines.targets) >= FEWEST:
        best = max(each.score for each in by_outlines(outlines))
        message = f"the model's outline follows edges in no reading of the poses ({best:.2f}, 0.5 by chance)"
        remedy = "check that the lists are of these pictures, the model and its unit, and that K is of this size"
        yield _finding("pose-image", message, remedy, outlines.targets, np.arange(len(lost)), 1 - own.each)


def _strangers(targets: PosedTargets) -> Iterator[SetFinding]:
    """Yield that poses agree with labels in no reading, as those of other pictures do."""
    fits = [each for reading in readings(targets) if (each := by_keypoints(targets, reading))]
    fit = max(fits, key=lambda each: each.score, default=None)
    if fit is not None and -fit.score > PIXELS:
        how = f"keypoints are {-fit.score:.3g} px off in the best"
    else:
        fit = max((by_boxes(targets, reading) for reading in readings(targets)), key=lambda each: each.score)
        how = f"boxes overlap by {fit.score:.2f} in the best"
        there = np.isfinite(fit.each)
        if there.sum() < FEWEST or fit.score > STRANGE or (targets.from_image.any() and not _elsewhere(targets)):
            return
    message = f"poses agree with labels in no reading ({how})"
    remedy = "check that the lists are of these pictures, in this order, and that K is of this size"
    yield _finding("pose-image", message, remedy, targets, np.arange(len(targets)), fit.each)


def _elsewhere(targets: PosedTargets) -> bool:
    """Return whether the middle of what is lit does not follow the body's origin through the pictures."""
    z = targets.t[:, 2:]
    origin = targets.t[:, :2] / np.where(z > 0, z, np.nan)
    boxes = targets.normalised(targets.boxes)
    there = np.isfinite(boxes).all(1) & np.isfinite(origin).all(1)
    if there.sum() < 2 * FEWEST:
        return False
    middle, origin = ((boxes[:, :2] + boxes[:, 2:]) / 2)[there], origin[there]
    spread, size = origin.std(0), np.median(np.linalg.norm(boxes[there, 2:] - boxes[there, :2], axis=1))
    if np.linalg.norm(spread) < size / 4 or not (spread > 0).all() or not (middle.std(0) > 0).all():
        return False
    return float(np.mean([np.corrcoef(middle[:, axis], origin[:, axis])[0, 1] for axis in (0, 1)])) < FOLLOWING


def _outliers(targets: PosedTargets, reading: Reading, model: Float | None) -> Iterator[SetFinding]:
    """Yield single pictures whose labels are not where their poses put the body."""
    points = by_keypoints(targets, reading)
    if points is not None and points.residuals is not None:
        yield from _keypoints(targets, points, points.residuals)
    boxes = by_boxes(targets, reading, model)
    if boxes.score < GOOD or boxes.ratio is None or boxes.apart is None:
        return
    far = np.abs(np.log(np.maximum(boxes.ratio, 1e-9))) > np.log(OFF)
    far &= (boxes.each < OUTLIER) & (~targets.from_image | (boxes.ratio > 1))  # part of the craft may be dark
    if far.any():
        ratio = float(np.median(boxes.ratio[far]))
        message = f"a distance is {_times(ratio)} what the size in the image gives, by the other pictures"
        yield _finding("distance", message, CORRECT, targets, np.flatnonzero(far), np.abs(np.log(boxes.ratio)))
    least = np.where(targets.from_image, 1e-9, OUTLIER)
    off = np.flatnonzero((boxes.each < least) & (boxes.apart > APART) & ~far)
    if len(off):
        message = "the target is not where its pose puts it"
        yield _finding("pose-image", message, CORRECT, targets, off, 1 - boxes.each)


def _keypoints(targets: PosedTargets, fit: Fit, residuals: Float) -> Iterator[SetFinding]:
    usual = max(-fit.score, 0.1)
    errors = np.linalg.norm(residuals, axis=2)
    worst = np.full(len(targets), np.nan)
    there = np.isfinite(errors).any(1)
    worst[there] = np.nanmax(errors[there], axis=1)
    off = np.flatnonzero(worst > max(2 * PIXELS, 10 * usual))
    if len(off) and usual < PIXELS:
        yield _finding("keypoint-pose", "keypoints are not where the pose puts them", CORRECT, targets, off, worst)
    if not there.any():
        return
    shift = np.nanmedian(residuals.reshape(-1, 2), axis=0)
    yield from _shifted(shift, "keypoints", "where poses put them", targets, np.arange(len(targets)), worst)


def _shifted(
    shift: Float, what: str, of: str, targets: PosedTargets, places: NDArray[np.intp], worse: Float
) -> Iterator[SetFinding]:
    """Yield labels that are shifted by the same pixels in all pictures."""
    size = np.abs(shift)
    if not np.isfinite(shift).all() or size.max() < SHIFT[0]:
        return
    half = bool((((size > SHIFT[0]) & (size < SHIFT[1])) | (size < 1 - SHIFT[1])).all())
    message = f"{what} are ({shift[0]:+.2f}, {shift[1]:+.2f}) px from {of}" + ": half a pixel" * half
    remedy = "check where K, or the labels, count the first pixel's centre: at (0, 0) or at (0.5, 0.5)"
    rule = "half-pixel" if half else "shifted"
    yield _finding(rule, message, remedy, targets, places, worse, WARNING if half else ERROR)


def _distances(targets: PosedTargets, model: Float | None) -> Iterator[SetFinding]:
    """Yield a unit of positions that makes the target too large or small, or contradicts depth."""
    size = targets.diagonals
    whole = np.isfinite(size)
    usual = float(np.nanmedian(size)) if whole.any() else np.nan
    if whole.sum() < FEWEST:
        yield from _depth(targets)
        return
    across = None if model is None else float(np.linalg.norm(np.ptp(model, axis=0)))
    likely = SIZES_M[0] < usual < SIZES_M[1]
    if not likely and (across is None or SIZES_M[0] < across < SIZES_M[1]):
        message = f"distances make the target {usual:.3g} m across, and no craft is so large or small"
        yield _unit(message, targets, 1e-3 if usual > SIZES_M[1] else 1e3)
        return
    if across is not None and not 1 / OFF < usual / (ASLANT * across) < OFF:
        message = f"distances make the target {usual:.3g} m across, and its model is {across:.3g} m across"
        remedy = "check the model's unit, --model-unit, and then the unit of positions"
        yield _finding("unit", message, remedy, targets, np.flatnonzero(whole), size)
        return
    yield from _depth(targets)


def _unit(message: str, targets: PosedTargets, factor: float) -> SetFinding:
    """Return the finding that all positions need a factor."""
    remedy = f"multiply positions by {factor:g}: spin-usd check SET --repair-to FOLDER writes such a copy"
    repair = Repair(length=factor)
    return SetFinding(
        rule="unit", message=message, remedy=remedy, pictures=targets.names, of=len(targets), repair=repair
    )


def _power(ratio: float) -> float:
    """Return the usual factor between units nearest to the ratio."""
    return min(POWERS, key=lambda each: abs(np.log(each / ratio)))


def _times(ratio: float) -> str:
    return f"{ratio:.3g} times" if ratio > 1 else f"1/{1 / ratio:.3g} of"


def _depth(targets: PosedTargets) -> Iterator[SetFinding]:
    """Yield depth that contradicts distances: in unit, in single pictures, or along rays instead of the axis."""
    depth = np.array([np.nan if m is None or m.depth is None else m.depth for *_, m in targets.rows], np.float64)
    z = targets.t[:, 2]
    there = np.isfinite(depth) & (z > 0)
    if not there.any():
        return
    ratio = np.full(len(targets), np.nan)
    ratio[there] = depth[there] / z[there]
    usual = float(np.nanmedian(ratio))
    if not 1 / OFF < usual < OFF:
        message = f"depth is {_times(usual)} the distance in the poses: a unit differs by {_power(usual):g}"
        remedy = "check the unit of depth, its scale, and the unit of positions"
        yield _finding("depth-unit", message, remedy, targets, np.flatnonzero(there), ratio)
        return
    yield from _one_late(targets, depth)
    off = np.flatnonzero(there & ~((ratio > usual / OFF) & (ratio < usual * OFF)))
    if len(off):
        message = f"depth contradicts the distance in the pose, being {_times(float(ratio[off[0]]))} it"
        yield _finding("depth-pose", message, CORRECT, targets, off, np.abs(np.log(ratio / usual)))
    yield from _along_rays(targets, depth, there)


def _one_late(targets: PosedTargets, depth: Float) -> Iterator[SetFinding]:
    """Yield sequences whose poses are of the picture before: depth then agrees with the next picture's distance."""
    sequences: dict[str, list[int]] = defaultdict(list)
    for place, (picture, *_) in enumerate(targets.rows):
        sequences[picture.labels.sequence].append(place)
    for name, places in sequences.items():
        z, seen = targets.t[places, 2], depth[places]
        if len(places) < 3 or not name or (z <= 0).any():
            continue
        diagonals = targets.diagonals[places]
        radius = RADIUS * float(np.nanmedian(diagonals)) if np.isfinite(diagonals).any() else np.inf
        own, following = np.abs(seen[:-1] - z[:-1]), np.abs(seen[:-1] - z[1:])
        if np.isfinite(own).any() and np.nanmedian(own) > radius > np.nanmedian(
            following
        ):  # no surface is so far from the body's origin
            message = f"poses of {name} are one picture late: depth agrees with the distance that the next one has"
            remedy = "give each picture the pose of the next"
            yield _finding(
                "pose-late", message, remedy, targets, np.array(places), np.abs(np.log(depth / targets.t[:, 2]))
            )


def _along_rays(targets: PosedTargets, depth: Float, there: NDArray[np.bool_]) -> Iterator[SetFinding]:
    """Yield depth that grows with the angle from the axis as the length of rays does.

    Depth less z of the pose, over z (sec - 1) at the mask's centre, has the slope 0 for depth along the axis, and 1 for
    lengths of rays.
    """
    secant = np.full(len(targets), np.nan)
    for place, (_, camera, _, measured) in enumerate(targets.rows):
        if there[place] and measured is not None and measured.centre is not None:
            x, y = camera.pinhole.normalised(np.array(measured.centre))
            secant[place] = np.sqrt(1 + x * x + y * y)
    used = np.isfinite(secant)
    if used.sum() < 2 * FEWEST:
        return
    z = targets.t[used, 2]
    x, y = z * (secant[used] - 1), depth[used] - z
    table = np.column_stack([x, np.ones(len(x)), z])
    solution, _, rank, _ = np.linalg.lstsq(table, y, rcond=None)
    if rank < 3:
        return
    error = np.sqrt(np.sum((y - table @ solution) ** 2) / (len(x) - 3) * np.linalg.inv(table.T @ table)[0, 0])
    if solution[0] - 3 * error > 0.3 and solution[0] + 3 * error > 1:
        message = f"depth is the length of rays, not along the camera's axis (slope {solution[0]:.2f} +- {error:.2f})"
        remedy = "divide it by the length of each pixel's ray (x, y, 1), or state it"
        yield _finding("depth-ray", message, remedy, targets, np.flatnonzero(used), secant)


def _silhouettes(targets: PosedTargets) -> Iterator[SetFinding]:
    """Yield masks that differ from the projected model."""
    seen = [(place, row[3].silhouette) for place, row in enumerate(targets.rows) if row[3] and row[3].silhouette]
    if not seen:
        return
    places = np.array([place for place, _ in seen])
    iou, edge = (np.array([getattr(each, name) for _, each in seen]) for name in ("iou", "edge"))
    worse = np.zeros(len(targets))
    worse[places] = 1 - iou
    off = places[iou < SILHOUETTE]
    if len(off):
        message = f"a mask overlaps the projected model by less than {SILHOUETTE} (median of all {np.median(iou):.3f})"
        yield _finding("mask-model", message, "check pose, model and its unit", targets, off, worse)
    if len(seen) >= FEWEST and abs(float(np.median(edge))) > EDGE and not len(off) > len(seen) / 2:
        message = f"the edges of masks are {np.median(edge):+.2g} px from those of the model (median)"
        yield _finding("mask-edge", message, "check model, lens and half pixels", targets, places, worse, WARNING)
    shift = np.median([each.shift for _, each in seen], axis=0)
    if len(seen) >= FEWEST and np.median(iou) > SILHOUETTE:
        yield from _shifted(shift, "masks", "the projected model", targets, places, worse)


RADIUS = 0.75  # of a target's diagonal in the image, beyond which no surface lies from its origin
SILHOUETTE = 0.8  # overlap (IoU) of mask and projection
EDGE = 1.5  # pixels


def _finding(
    rule: str,
    message: str,
    remedy: str,
    targets: PosedTargets,
    places: NDArray[np.intp],
    worse: Float,
    severity: str = ERROR,
) -> SetFinding:
    names = targets.names
    pictures = worst_first((names[place], float(np.nan_to_num(worse[place]))) for place in places)
    return SetFinding(
        rule=rule, message=message, remedy=remedy, pictures=pictures, of=len(set(names)), severity=severity
    )

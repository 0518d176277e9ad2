"""Faults that data sets have, planted in sets in the layouts of others: `check` names each by the right rule.

The default tests plant the most important ones; the slow ones plant all in the layouts that can have them.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Any

import cv2
import numpy as np
import pytest

from spin_usd import check
from tests.cases.foreign_sets import BOXED, KEYPOINTS, LAYOUTS, MASKED, MATRICES, POSED, QUATERNIONS
from tests.commands.check.planted import EVERY, SIZE, PlantedSet, inverse, matrix

ASIDE = np.array([0.35, 0, 0])
WIDTH, _ = SIZE
LISTED = ("speedplus", "speed", "shirt")  # layouts of SPEED's kin
IMAGES = tuple(name for name in LAYOUTS if name != "kitti")  # layouts with lists of images
NOT_URSO = tuple(name for name in POSED if name != "urso")  # whose positions are in other axes than rotations
MIXED = ("speedplus", "spark stream 2", "urso", "coco", "yolo detect", "bop")  # one of each kind of list
COLOURED = ("coco", "bop", "spark 2022", "urso", "kitti")


@dataclass(frozen=True)
class Fault:
    """A fault, the layouts that can have it, and the rules of which one must name it."""

    name: str
    layouts: Sequence[str]
    plant: Callable[[PlantedSet], object]
    rules: frozenset[str]


def of_poses(change, **how) -> Callable[[PlantedSet], None]:
    return lambda planted: planted.poses(change, **how)


def of_boxes(change, **how) -> Callable[[PlantedSet], None]:
    return lambda planted: planted.boxes(change, **how)


def of_images(change, **how) -> Callable[[PlantedSet], None]:
    return lambda planted: planted.pixels(planted.image_files(), change, **how)


def of_masks(change, **how) -> Callable[[PlantedSet], None]:
    return lambda planted: planted.pixels(planted.mask_files(), change, **how)


def of_points(change, **how) -> Callable[[PlantedSet], None]:
    return lambda planted: planted.keypoints(change, **how)


def faults() -> list[Fault]:
    """Return all faults."""
    return [
        Fault(name, tuple(layouts), plant, frozenset(rules.split()))
        for name, layouts, plant, rules in (*POSES, *CAMERAS, *FILES, *PICTURES, *BOXES, *POINTS, *DEPTH)
    ]


def seen_from_body(rotation, place):
    """The position of the camera in the body's axes."""
    return -matrix(rotation).T @ place


def is_scaled(factor) -> Callable[[PlantedSet], None]:
    return of_poses(lambda rotation, place: (rotation, place * factor))


def shuffle(planted) -> None:
    """Give each picture the pose of another."""
    poses: list[Any] = []

    def kept(*pose):
        poses.append(pose)
        return pose

    planted.poses(kept)
    order = cycle(np.random.default_rng(1).permutation(len(poses)))
    planted.poses(lambda *pose: poses[next(order)])


def left_handed(rotation, place):
    return np.concatenate([-rotation[:3], rotation[3:]]), place


POSE_FINDINGS = "pose-image keypoint-pose mask-model distance"
POSES = (
    ("scalar at the other end", QUATERNIONS, of_poses(lambda q, t: (q, t), scalar_last=True), "pose-reading"),
    ("inverse rotations", POSED, of_poses(lambda q, t: (inverse(q), t)), "pose-reading"),
    ("inverse, other end", MIXED[:-1], of_poses(lambda q, t: (inverse(q), t), scalar_last=True), "pose-reading"),
    ("positions of the camera", NOT_URSO, of_poses(lambda q, t: (q, seen_from_body(q, t))), "pose-reading"),
    ("inverse poses", NOT_URSO, of_poses(lambda q, t: (inverse(q), seen_from_body(q, t))), "pose-reading"),
    ("some inverse rotations", (*KEYPOINTS, "bop"), of_poses(lambda q, t: (inverse(q), t), some=True), POSE_FINDINGS),
    (
        "some wrong positions",
        MIXED,
        of_poses(lambda q, t: (q, np.add(t, (0.35 * t[2], 0, 0))), some=True),
        POSE_FINDINGS,
    ),
    ("some of ten times the range", MIXED, of_poses(lambda q, t: (q, t * 10), some=True), "distance"),
    ("some of ten times the depth", MIXED, of_poses(lambda q, t: (q, t * [1, 1, 10]), some=True), POSE_FINDINGS),
    ("millimetres", ("speedplus", "spark stream 2", "urso"), is_scaled(1000), "unit"),
    ("metres", MATRICES, is_scaled(0.001), "unit"),
    ("poses of other pictures", MIXED, shuffle, "pose-image keypoint-pose pose-reading"),
    ("length of quaternions", MIXED[:-1], of_poses(lambda q, t: (q * 1.02, t), some=True), "quaternion-norm"),
    ("left-handed", MATRICES, of_poses(left_handed, some=True), "rotation-matrix"),
    ("scaled matrices", MATRICES, of_poses(lambda R, t: (R * 1.1, t)), "rotation-matrix"),
    ("behind", MIXED, of_poses(lambda q, t: (q, t * [1, 1, -1]), some=True), "behind-camera"),
    ("no numbers", MIXED, of_poses(lambda q, t: (q, t * [1, 1, np.nan]), some=True), "pose-numbers"),
)


def moved_centre(planted) -> None:
    planted.camera(lambda K: K * [[1, 1, 1.8], [1, 1, 1], [1, 1, 1]])


def other_size(planted) -> None:
    for document in planted.documents(r"^camera\.json"):
        document.update(Nu=480, Nv=300)


CAMERAS = (
    ("principal point", (*LISTED, *MATRICES), moved_centre, "camera-matrix"),
    ("unequal focal lengths", (*LISTED, *MATRICES), lambda each: each.camera(lambda K: K * [[1], [1.3], [1]]),
     "camera-matrix"),
    ("camera of another size", LISTED, other_size, "image-size"),
)  # fmt: skip


def lose_an_image(planted) -> None:
    planted.image_files()[5].unlink()


def rename_images(planted) -> None:
    for path in planted.image_files()[::EVERY]:
        path.rename(path.with_name(f"x_{path.name}"))


def upper_case(planted) -> None:
    for path in planted.image_files()[::EVERY]:
        path.rename(path.with_name(path.name.upper()))


def cut_short(planted) -> None:
    for path in planted.image_files()[::EVERY]:
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def same_bytes(planted) -> None:
    images = planted.image_files()
    images[20].write_bytes(images[3].read_bytes())


def alike(planted) -> None:
    """Encode the image of one picture again as that of another."""
    images = planted.image_files()
    image = cv2.imread(str(images[7]), cv2.IMREAD_UNCHANGED)
    image.flat[0] += 1
    cv2.imwrite(str(images[15]), image, [cv2.IMWRITE_JPEG_QUALITY, 93])


def in_two_splits(planted) -> None:
    lists = [path for name in ("train.json", "validation.json") for path in planted.root.rglob(name)]
    train, validation = (json.loads(path.read_text()) for path in lists)
    lists[1].write_text(json.dumps(validation + train[:3]))


def listed_twice(planted) -> None:
    for document in planted.documents(r"train\.json$"):
        document.append(document[0])


def exchange_times(planted) -> None:
    path = next(planted.root.rglob("image_02/timestamps.txt"))
    lines = path.read_text().splitlines()
    lines[10], lines[15] = lines[15], lines[10]
    path.write_text("\n".join(lines))


FILES = (
    ("an image lost", IMAGES, lose_an_image, "image-lost"),
    ("an image without a time lost", ("kitti",), lose_an_image, "files"),
    ("images renamed", MIXED, rename_images, "image-lost"),
    ("names in another case", (*LISTED, "spark stream 2", "urso", "coco"), upper_case, "image-name"),
    ("images cut short", LAYOUTS, cut_short, "unreadable"),
    ("the bytes of another image", LAYOUTS, same_bytes, "duplicate split-overlap"),
    ("the looks of another image", (*LISTED, "coco", "bop"), alike, "duplicate split-overlap"),
    ("images in two splits", ("speedplus", "speed"), in_two_splits, "split-overlap"),
    ("images listed twice", ("speedplus", "speed"), listed_twice, "listed-twice"),
    ("times that go back", ("kitti",), exchange_times, "time-order"),
)


def encoded_again(image):
    """Apply sRGB's curve to 8-bit values once more."""
    x = image / 255
    return np.rint(255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)).astype(np.uint8)


def equal_channels(image):
    return np.repeat(image.mean(2, keepdims=True), 3, 2).astype(np.uint8)


def half(image, how=cv2.INTER_NEAREST):
    return cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=how)


def resampled(image):
    return cv2.resize(half(image, cv2.INTER_LINEAR), image.shape[1::-1], interpolation=cv2.INTER_LINEAR)


MIRRORED = "mirrored box-mask pose-image pose-reading box-order"
LABELLED = tuple(dict.fromkeys((*MASKED, *BOXED)))
PICTURES = (
    ("images mirrored", LABELLED, of_images(lambda image: image[:, ::-1]), MIRRORED),
    ("images upside down", LABELLED, of_images(lambda image: image[::-1]), MIRRORED),
    ("some images mirrored", LABELLED, of_images(lambda image: image[:, ::-1], some=True), MIRRORED),
    ("masks mirrored", MASKED, of_masks(lambda mask: mask[:, ::-1]), MIRRORED),
    ("masks upside down", MASKED, of_masks(lambda mask: mask[::-1]), MIRRORED),
    ("masks of half the size", MASKED, of_masks(half), "label-size"),
    ("masks resampled", ("bop", "swisscube"), of_masks(resampled), "mask-grey"),
    ("masks empty", ("bop", "spark 2024"), of_masks(np.zeros_like, some=True), "mask-empty"),
    ("equal channels", COLOURED, of_images(equal_channels), "equal-channels"),
    ("encoded twice", COLOURED, of_images(encoded_again), "encoded-twice"),
)


def less_visible(planted) -> None:
    for document in planted.documents("scene_gt_info"):
        for (body,) in document.values():
            body["visib_fract"] *= 0.6


def unknown_class(planted) -> None:
    for document in planted.documents("^annotations/"):
        document["annotations"][2]["category_id"] = 7
    for place, words in enumerate(planted.lines()):
        words[0] = "7" if place == 2 else words[0]


BOXES = (
    ("boxes rows first", BOXED, of_boxes(lambda x0, y0, x1, y1: (y0, x0, y1, x1)), "box-order"),
    ("some boxes rows first", BOXED, of_boxes(lambda x0, y0, x1, y1: (y0, x0, y1, x1), some=True),
     "box-mask pose-image"),
    ("ends for sides", ("coco", "bop"), of_boxes(lambda x0, y0, x1, y1: (x0, y0, x0 + x1, y0 + y1)), "box-order"),
    ("sides for ends", ("spark 2021", "spark 2022", "spark 2024"),
     of_boxes(lambda x0, y0, x1, y1: (x0, y0, x1 - x0, y1 - y0)), "box-order box-empty"),
    ("corner for middle", ("yolo detect", "yolo pose"),
     of_boxes(lambda x0, y0, x1, y1: ((3 * x0 - x1) / 2, (3 * y0 - y1) / 2, (x0 + x1) / 2, (y0 + y1) / 2)),
     "box-order"),
    ("boxes out of the frame", BOXED,
     of_boxes(lambda x0, y0, x1, y1: (x0 + 500, y0, x1 + 700, y1), some=True), "box-outside box-mask"),
    ("boxes reversed", BOXED, of_boxes(lambda x0, y0, x1, y1: (x1, y1, x0, y0), some=True), "box-empty"),
    ("visible shares", ("bop",), less_visible, "visible-share"),
    ("unknown class", ("coco", "yolo detect", "yolo segment"), unknown_class, "class-unknown"),
)  # fmt: skip
POINTS = (
    ("keypoints mirrored", KEYPOINTS, of_points(lambda uv: [WIDTH, 0] + uv * [-1, 1]), "mirrored"),
    ("some keypoints wrong", KEYPOINTS, of_points(lambda uv: np.add(uv, (12, -9)), some=True), "keypoint-pose"),
    ("keypoints rows first", KEYPOINTS, of_points(lambda uv: uv[:, ::-1]),
     "keypoint-pose pose-reading keypoint-outside pose-image"),
)  # fmt: skip


def depth_times(factor) -> Callable[[PlantedSet], None]:
    def change(depth):
        return np.clip(depth * factor, 0, 65535).astype(np.uint16)

    return lambda planted: planted.pixels(planted.depth_files(), change)


DEPTH = (
    ("depth of a tenth", ("bop",), depth_times(0.1), "depth-unit"),
    ("depth without a half", ("bop",), lambda each: each.pixels(each.depth_files(), lambda depth: np.where(
        np.arange(WIDTH) < WIDTH / 2, depth, 0).astype(np.uint16)), "depth-mask"),
)  # fmt: skip
FAULTS = {fault.name: fault for fault in faults()}


def found(foreign_sets, folder, name) -> dict[str, str]:
    """Return the messages of the findings by their rules."""
    report = check(folder, **foreign_sets.options(name))
    return {finding.code: finding.message for finding in report.findings}


def is_named(foreign_sets, folder, fault, name) -> None:
    """Plant the fault in a copy of the set in that layout, and find it."""
    copy = foreign_sets.copy(name, folder / "set")
    FAULTS[fault].plant(PlantedSet(copy))
    findings = found(foreign_sets, copy, name)
    assert findings.keys() & FAULTS[fault].rules, findings


@pytest.mark.parametrize(
    ("fault", "name"),
    [
        ("scalar at the other end", "speedplus"),
        ("inverse rotations", "coco"),
        ("some of ten times the range", "bop"),
        ("boxes rows first", "spark 2024"),
        ("images cut short", "kitti"),
        ("an image lost", "spark 2022"),
    ],
)
def test_the_most_important_faults_are_named(foreign_sets, tmp_path, fault, name) -> None:
    is_named(foreign_sets, tmp_path, fault, name)


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "name"), [(fault, name) for fault in FAULTS for name in FAULTS[fault].layouts])
def test_planted_faults_are_named(foreign_sets, tmp_path, fault, name) -> None:
    is_named(foreign_sets, tmp_path, fault, name)


@pytest.mark.parametrize("name", ["coco", "bop", "spark 2021", "kitti"])
def test_a_right_set_has_no_finding(foreign_sets, name) -> None:
    assert not found(foreign_sets, foreign_sets.export(name), name)


@pytest.mark.slow
@pytest.mark.parametrize("name", LAYOUTS)
def test_a_right_set_of_any_layout_has_no_finding(foreign_sets, name) -> None:
    assert not found(foreign_sets, foreign_sets.export(name), name)

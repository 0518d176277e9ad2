"""Readings of poses beside labels of a synthetic body, whose true reading is known."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spin_usd.audit.pose_rules import pose_findings
from spin_usd.audit.readings import Reading, by_boxes, by_keypoints, readings, turned_enough
from spin_usd.geometry.camera import Camera
from tests.audit.synthetic import BODY, CAMERA, audited, changed, synthetic

EXACT = 1e-6  # pixels
ALL = [Reading(other_order=order, inverse=inverse, of_camera=camera)
       for order, inverse, camera in product((False, True), repeat=3)]  # fmt: skip
WRONG = ALL[1:]
LENS = replace(CAMERA, distortion=(-0.22, 0.51, -0.0006, -0.0002, -0.13))


def written_as(target, reading):
    """Write the target's right pose wrongly, so that the reading is right."""
    R = Rotation.from_quat(target.rotation, scalar_first=True)
    t = -R.inv().apply(target.t_cam_body) if reading.of_camera else target.t_cam_body
    q = target.rotation * [1, -1, -1, -1] if reading.inverse else target.rotation
    return replace(target, rotation=np.roll(q, -1) if reading.other_order else q, t_cam_body=t)


def mirrored(target, how, camera=CAMERA):
    """Mirror the labels."""
    axis, size = (0, camera.width) if how == "left to right" else (1, camera.height)
    box, points = target.box.copy(), None if target.keypoints is None else target.keypoints.copy()
    box[[axis, axis + 2]] = size - target.box[[axis + 2, axis]]
    if points is not None:
        points[:, axis] = size - points[:, axis]
    return replace(target, box=box, keypoints=points)


def posed(pictures, **labels):
    return audited(pictures, **labels).posed["target"]


def rules(pictures, model=None, **labels):
    models = {} if model is None else {"": model}
    return {each.rule: each for each in pose_findings(audited(pictures, **labels), models)}


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), reading=st.sampled_from(ALL))
def test_of_all_readings_only_the_right_one_puts_keypoints_right(seed, reading) -> None:
    targets = posed(changed(synthetic(12, seed=seed, keypoints=True), lambda each: written_as(each, reading)))
    scores = {each: -by_keypoints(targets, each).score for each in ALL}
    assert scores.pop(reading) < EXACT
    assert min(scores.values()) > 1


@pytest.mark.parametrize("camera", [CAMERA, LENS], ids=["pinhole", "lens"])
def test_keypoints_are_the_bodys_points(camera) -> None:
    """Lenses bend nothing: residuals of right poses are zero, and each keypoint's too."""
    fit = by_keypoints(posed(synthetic(20, keypoints=True, camera=camera)), Reading())
    assert np.abs(fit.residuals).max() < 1e-3
    assert fit.residuals.shape == (20, len(BODY), 2)


@settings(max_examples=6)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_models_boxes_agree_exactly_in_the_right_reading(seed) -> None:
    """The boxes of the body's own points are the labels, so the overlap is 1 there, and less elsewhere."""
    targets = posed(synthetic(20, seed=seed))
    fits = {each: by_boxes(targets, each, BODY) for each in readings(targets)}
    own = fits.pop(Reading())
    assert own.score == pytest.approx(1)
    assert np.nanmax(own.apart) < EXACT
    np.testing.assert_allclose(own.ratio[np.isfinite(own.ratio)], 1)
    assert max(fit.score for fit in fits.values()) < own.score - 0.05


@pytest.mark.parametrize("reading", WRONG, ids=lambda reading: reading.name)
@pytest.mark.parametrize("keypoints", [True, False], ids=["keypoints", "boxes"])
def test_wrong_poses_are_named_with_the_reading_that_mends_them(reading, keypoints) -> None:
    pictures = changed(synthetic(30, keypoints=keypoints), lambda each: written_as(each, reading))
    found = rules(pictures)["pose-reading"]
    assert found.repair.reading == reading
    assert len(found.pictures) == found.of == 30
    assert reading.name in found.message


@pytest.mark.parametrize("keypoints", [True, False], ids=["keypoints", "boxes"])
def test_one_list_of_several_that_is_written_otherwise_is_named_and_repaired_alone(keypoints) -> None:
    first, second = (synthetic(20, seed=seed, keypoints=keypoints) for seed in (1, 2))
    wrong = changed(second, lambda each: written_as(each, WRONG[1]))
    lists = [
        *(replace(each, place=f"train.json, entry {n}") for n, each in enumerate(first)),
        *(replace(each, name=f"b{n}.png", place=f"test.json, entry {n}") for n, each in enumerate(wrong)),
    ]
    found = rules(lists)["pose-reading"]
    assert sorted(found.pictures) == sorted(f"b{n}.png" for n in range(20))
    assert found.repair.lists == {"test.json"}
    assert found.repair.reading == WRONG[1]


@pytest.mark.parametrize("how", ["left to right", "upside down"])
def test_mirrored_keypoints_are_named_and_not_repaired(how) -> None:
    found = rules(changed(synthetic(30, keypoints=True), lambda each: mirrored(each, how)))["mirrored"]
    assert how in found.message
    assert found.repair is None


@pytest.mark.parametrize("keypoints", [True, False])
@pytest.mark.parametrize("matrices", [True, False])
@pytest.mark.parametrize("camera", [CAMERA, LENS], ids=["pinhole", "lens"])
def test_right_sets_have_no_finding(keypoints, matrices, camera) -> None:
    pictures = synthetic(24, keypoints=keypoints, matrices=matrices, camera=camera)
    assert not rules(pictures)
    assert not rules(pictures, BODY)


def test_the_layouts_own_quaternions_are_converted() -> None:
    """A layout whose quaternions are conjugate, with their scalar last, is right as it is."""

    def as_layout(target):
        return replace(target, rotation=target.rotation * [1, -1, -1, -1])

    pictures = changed(synthetic(30), as_layout)
    assert not rules(pictures, q_cam_body=lambda q: q * [1, -1, -1, -1], scalar_last=True)
    assert "pose-reading" in rules(pictures)


def test_one_attitude_tells_no_reading() -> None:
    """All readings leave some body where it never turns: no verdict rather than a wrong one."""
    first = synthetic(1)[0].targets[0]
    still = changed(synthetic(30), lambda each: replace(each, rotation=first.rotation))
    assert not turned_enough(posed(still))
    assert not rules(still)


def test_few_pictures_are_no_verdict() -> None:
    assert not rules(changed(synthetic(7), lambda each: written_as(each, WRONG[1])))


def test_wrong_poses_of_some_pictures_are_named_by_picture() -> None:
    """With keypoints, and with boxes: exactly these pictures."""
    for keypoints, rule in ((True, "keypoint-pose"), (False, "pose-image")):
        aside = changed(synthetic(40, keypoints=keypoints), lambda each: replace(
            each, t_cam_body=each.t_cam_body + np.array([0.3, 0, 0]) * each.t_cam_body[2]), every=8)  # fmt: skip
        assert sorted(rules(aside)[rule].pictures) == [f"img{place:03}.png" for place in range(0, 40, 8)]


@pytest.mark.parametrize("factor", [10.0, 0.1])
def test_distances_of_some_pictures_that_are_ten_times_wrong(factor) -> None:
    """79 m where it is 7.9 m, along the same ray."""
    far = changed(synthetic(40), lambda each: replace(each, t_cam_body=each.t_cam_body * factor), every=8)
    found = rules(far, BODY)["distance"]
    assert sorted(found.pictures) == [f"img{place:03}.png" for place in range(0, 40, 8)]


@pytest.mark.parametrize(("factor", "mends"), [(1000.0, 0.001), (0.001, 1000.0), (10.0, None), (0.1, None)])
def test_units_of_positions_beside_a_model(factor, mends) -> None:
    """A craft of 16 m may be one, and its model's unit wrong: only what no craft can be is repaired."""
    wrong = changed(synthetic(20), lambda each: replace(each, t_cam_body=each.t_cam_body * factor))
    repair = rules(wrong, BODY)["unit"].repair
    assert (repair and repair.length) == mends


@pytest.mark.parametrize(("factor", "mends"), [(1000.0, 0.001), (0.001, 1000.0)])
def test_units_that_no_craft_has_without_a_model(factor, mends) -> None:
    wrong = changed(synthetic(20), lambda each: replace(each, t_cam_body=each.t_cam_body * factor))
    assert rules(wrong)["unit"].repair.length == mends


def test_keypoints_of_half_a_pixel() -> None:
    def moved(target):
        return replace(target, keypoints=np.add(target.keypoints, (0.5, 0.5, 0)))

    found = rules(changed(synthetic(60, keypoints=True), moved))
    assert found.keys() == {"half-pixel"}


def test_poses_of_other_pictures_agree_in_no_reading() -> None:
    pictures = synthetic(40, keypoints=True)
    others = [each.targets[0] for each in pictures[7:] + pictures[:7]]
    wrong = [
        replace(each, targets=(replace(each.targets[0], rotation=of.rotation, t_cam_body=of.t_cam_body),))
        for each, of in zip(pictures, others, strict=True)
    ]
    assert "pose-image" in rules(wrong)


def test_boxes_that_the_frame_cuts_off_say_nothing_about_what_is_beyond() -> None:
    """A camera of a third of the picture sees most bodies in part: no finding."""
    small = Camera(width=240, height=200, fx=700.0, fy=700.0, cx=120.0, cy=100.0)

    def clipped(target):
        box = target.box - [200, 140, 200, 140]
        return replace(target, box=np.clip(box, 0, [240, 200, 240, 200]))

    cut = [replace(each, camera=small) for each in changed(synthetic(60), clipped)]
    assert not rules([each for each in cut if (each.targets[0].box[2:] > each.targets[0].box[:2] + 2).all()], BODY)

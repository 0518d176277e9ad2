"""Rules on pixels: each finds its fault in hand-made measures, and is silent without it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from spin_usd.audit.annotated_set import AnnotatedTarget, MaskSource
from spin_usd.audit.picture_measures import TargetMeasures
from spin_usd.audit.pixel_rules import BOX_READINGS, overlap, pixel_findings
from spin_usd.audit.pose_rules import pose_findings
from tests.audit.synthetic import CAMERA, audited, measured, picture, synthetic

SIZE = np.array([CAMERA.width, CAMERA.height], np.float64)
MASKED = AnnotatedTarget(id="a", box=np.array([100.0, 50, 200, 90]), mask=MaskSource(file="m.png"), pixels=3000)
SEEN = TargetMeasures(box=[100.0, 50, 200, 90], pixels=3000, centre=(150.0, 70.0), lit=(0.98, 0.1, 0.1, 0.1))
corner = st.floats(0, 300)
side = st.floats(20, 300)


def written_wrongly(box, reading):
    """The numbers that a reader takes for x0, y0, x1, y1 where they were written so that the reading is right."""
    x0, y0, x1, y1 = box
    w, h, width, height = x1 - x0, y1 - y0, *SIZE
    return {
        "rows before columns": [y0, x0, y1, x1],
        "rows before columns, in shares": [y0 / height * width, x0 / width * height, y1 / height * width,
                                           x1 / width * height],
        "x0, y0, x1, y1 in place of x, y, width, height": [x0, y0, x0 + x1, y0 + y1],
        "x, y, width, height in place of x0, y0, x1, y1": [x0, y0, w, h],
        "the middle in place of a corner": [x0 + w / 2, y0 + h / 2, x1 + w / 2, y1 + h / 2],
        "a corner in place of the middle": [x0 - w / 2, y0 - h / 2, x1 - w / 2, y1 - h / 2],
        "x0, y0, x1, y1 in place of the middle, width and height": [x0 - x1 / 2, y0 - y1 / 2, x0 + x1 / 2, y0 + y1 / 2],
    }[reading]  # fmt: skip


@pytest.mark.parametrize("reading", BOX_READINGS)
@given(x=corner, y=corner, w=side, h=side)
def test_a_reading_of_boxes_undoes_how_they_were_written(reading, x, y, w, h) -> None:
    right = np.array([x, y, x + w, y + h])
    made = BOX_READINGS[reading](np.array(written_wrongly(right, reading)), SIZE)
    np.testing.assert_allclose(made, right, rtol=0, atol=1e-9)


@given(x=corner, y=corner, w=side, h=side, dx=st.floats(-50, 50), dy=st.floats(-50, 50))
def test_overlap_is_a_share_symmetric_and_one_for_equal_boxes(x, y, w, h, dx, dy) -> None:
    a = np.array([x, y, x + w, y + h])
    b = np.add(a, (dx, dy, dx, dy))
    assert overlap(a, a) == pytest.approx(1)
    assert 0 <= overlap(a, b) == pytest.approx(overlap(b, a))
    shared = max(w - abs(dx), 0) * max(h - abs(dy), 0)
    assert overlap(a, b) == pytest.approx(shared / (2 * w * h - shared))


def rules(pictures, measures, **labels):
    return {each.rule: each for each in pixel_findings(audited(pictures, measures, **labels))}


def boxed(change=lambda box: box, *, masks=True, count=20):
    """Return pictures with boxes as `change` writes them, and measures of where they are."""
    right = [each.targets[0].box for each in synthetic(count)]
    pictures = [picture(f"{place}.png", AnnotatedTarget(id="a", box=np.array(change(box), np.float64)))
                for place, box in enumerate(right)]  # fmt: skip
    measures = [
        measured(each.name, TargetMeasures(box=box.tolist() if masks else None, pixels=99), lit_box=box.tolist())
        for each, box in zip(pictures, right, strict=True)
    ]
    return pictures, measures


@pytest.mark.parametrize("masks", [True, False])
@pytest.mark.parametrize("reading", BOX_READINGS)
def test_boxes_in_another_order_are_named(reading, masks) -> None:
    found = rules(*boxed(lambda box: written_wrongly(box, reading), masks=masks))
    assert reading in found["box-order"].message
    assert len(found["box-order"].pictures) == 20


@pytest.mark.parametrize("masks", [True, False])
def test_right_boxes_and_those_of_rounded_pixels_have_no_finding(masks) -> None:
    assert not rules(*boxed(masks=masks))
    assert not rules(*boxed(lambda box: np.add(np.rint(box), (-1, -1, 1, 1)), masks=masks))


def test_a_single_wrong_box_is_named_alone() -> None:
    pictures, measures = boxed()
    target = pictures[3].targets[0]
    pictures[3] = replace(pictures[3], targets=(replace(target, box=target.box + 200),))
    found = rules(pictures, measures)
    assert list(found["box-mask"].pictures) == ["3.png"]


def one(target=MASKED, seen=SEEN, **measures):
    """Return a picture with its measures, in lists."""
    return [picture("a.png", target)], [measured("a.png", seen, **measures)]


def test_a_right_picture_has_no_finding() -> None:
    assert not rules(*one())


@pytest.mark.parametrize(
    ("rule", "seen", "measures"),
    [
        ("unreadable", {}, {"errors": {"a.png": "is cut short"}}),
        ("image-size", {}, {"size": (320, 240)}),
        ("label-size", {}, {"mask_size": (320, 240)}),
        ("equal-channels", {}, {"equal_channels": True}),
        ("encoded-twice", {}, {"twice_encoded": True}),
        ("box-mask", {"box": [300.0, 200, 340, 240]}, {}),
        ("mirrored", {"lit": (0.1, 0.9, 0.1, 0.1)}, {}),
        ("mirrored", {"lit": (0.1, 0.1, 0.9, 0.1)}, {}),
        ("mirrored", {"lit": (0.1, 0.1, 0.1, 0.9)}, {}),
        ("mask-empty", {"box": None, "pixels": 0}, {}),
        ("mask-pixels", {"pixels": 2000}, {}),
        ("mask-grey", {"grey": 0.3}, {}),
        ("depth-mask", {"without_depth": 0.5}, {}),
        ("depth-mask", {"beside_mask": 0.5}, {}),
    ],
)
def test_what_a_picture_measures_is_named_by_its_rule_alone(rule, seen, measures) -> None:
    assert rules(*one(seen=structs.replace(SEEN, **seen), **measures)).keys() == {rule}


def test_grey_masks_are_no_fault_where_the_layout_has_jpegs() -> None:
    assert not rules(*one(seen=structs.replace(SEEN, grey=0.3)), masks_are_lossy=True)


def test_a_picture_of_another_size_says_the_factor_of_k() -> None:
    assert rules(*one(size=(320, 240)))["image-size"].remedy == "multiply K by 0.5"


def twins(looks=("00" * 256, "00" * 256), digests=("x", "x"), splits=("train", "train"), apart=0.0):
    poses = [each.targets[0] for each in synthetic(2)]
    poses[1] = poses[1] if apart else replace(poses[1], rotation=poses[0].rotation, t_cam_body=poses[0].t_cam_body)
    pictures = [picture(f"{n}.png", replace(pose, box=None), split=splits[n]) for n, pose in enumerate(poses)]
    measures = [measured(f"{n}.png", sha256=digests[n], look=looks[n]) for n in range(2)]
    return rules(pictures, measures)


def test_equal_bytes_across_splits_or_poses() -> None:
    assert twins()["duplicate"].severity == "warning"
    assert twins(apart=1.0)["duplicate"].severity == "error"
    assert "split-overlap" in twins(splits=("train", "test"))
    assert not twins(digests=("x", "y"))


def test_equal_looks_of_other_bytes_matter_under_other_poses_alone() -> None:
    other = "ff" * 256
    assert twins(digests=("x", "y"), apart=1.0)["duplicate"].severity == "warning"
    assert not twins(digests=("x", "y"), apart=1.0, looks=("00" * 256, other))


def deep(along, count=60, factor=1.0):
    """Return the rules of poses beside depth that is `along` the rays by that share."""
    pictures = synthetic(count, keypoints=True)  # by which readings are told sooner than by boxes
    measures = []
    for each in pictures:
        x, y, z = each.targets[0].t_cam_body
        length = 1 + along * (np.sqrt(1 + (x / z) ** 2 + (y / z) ** 2) - 1)
        pixel = CAMERA.project(np.array([[x, y, z]]))[0]
        seen = TargetMeasures(
            box=each.targets[0].box.tolist(), pixels=99, centre=tuple(pixel), depth=factor * z * length
        )
        measures.append(measured(each.name, seen))
    return {each.rule: each for each in pose_findings(audited(pictures, measures), {})}


def test_depth_along_rays_is_told_from_depth_along_the_axis() -> None:
    assert not deep(0.0)
    assert deep(1.0).keys() == {"depth-ray"}


@pytest.mark.parametrize("factor", [0.001, 0.1, 10.0, 1000.0])
def test_depth_in_another_unit(factor) -> None:
    assert deep(0.0, factor=factor).keys() == {"depth-unit"}

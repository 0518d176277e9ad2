"""Rules on lists: each finds its fault in a hand-made set, names the right pictures, and is silent without it."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.audit.annotated_set import AnnotatedTarget, Fault
from spin_usd.audit.list_rules import TARGET_RULES, list_findings
from spin_usd.geometry.camera import Camera
from tests.audit.synthetic import CAMERA, audited, picture, synthetic

RIGHT = AnnotatedTarget(
    id="a", rotation=np.array([1.0, 0, 0, 0]), t_cam_body=np.array([0.0, 0, 5]), box=np.array([10.0, 10, 50, 40]),
    keypoints=np.array([[20.0, 20, 2], [0, 0, 0]]), visible=0.5, pixels=100, whole=200,
)  # fmt: skip
EYE = np.eye(3)


def rules(pictures, **labels):
    return {each.rule: each for each in list_findings(audited(pictures, **labels))}


def test_right_lists_have_no_finding() -> None:
    assert not rules([picture("a.png", RIGHT), picture("b.png", replace(RIGHT, rotation=EYE))])
    assert not rules(synthetic(10, keypoints=True))


@pytest.mark.parametrize(
    ("rule", "wrong"),
    [
        ("pose-numbers", {"t_cam_body": np.array([0, 0, np.nan])}),
        ("pose-numbers", {"rotation": np.array([np.inf, 0, 0, 0])}),
        ("pose-numbers", {"rotation": np.zeros(4)}),
        ("pose-numbers", {"rotation": None}),
        ("quaternion-norm", {"rotation": np.array([1.002, 0, 0, 0])}),
        ("rotation-matrix", {"rotation": EYE * [1, 1, -1]}),
        ("rotation-matrix", {"rotation": EYE * 1.01}),
        ("rotation-matrix", {"rotation": EYE[[0, 0, 2]]}),
        ("behind-camera", {"t_cam_body": np.array([0.0, 0, -5])}),
        ("behind-camera", {"t_cam_body": np.zeros(3)}),
        ("box-empty", {"box": np.array([10.0, 10, 10, 40])}),
        ("box-empty", {"box": np.array([50.0, 40, 10, 10])}),
        ("box-empty", {"box": np.array([np.nan, 10, 50, 40])}),
        ("box-outside", {"box": np.array([-5.0, 10, 50, 40])}),
        ("box-outside", {"box": np.array([10.0, 10, 50, CAMERA.height + 5])}),
        ("visible-share", {"visible": 1.5}),
        ("visible-share", {"visible": 0.7}),
        ("keypoint-flags", {"keypoints": np.array([[20.0, 20, 3]])}),
        ("keypoint-outside", {"keypoints": np.array([[-20.0, 20, 2]])}),
        ("keypoint-outside", {"keypoints": np.array([[CAMERA.width + 20.0, 20, 2]])}),
    ],
)
def test_a_wrong_target_is_named_by_its_rule_alone(rule, wrong) -> None:
    others = [picture(f"{name}.png", RIGHT) for name in "ac"]
    found = rules([others[0], picture("b.png", replace(RIGHT, **wrong)), others[1]])
    assert found.keys() == {rule}
    assert (list(found[rule].pictures), found[rule].of) == (["b.png"], 3)


def test_each_rule_of_targets_is_tested() -> None:
    mark = test_a_wrong_target_is_named_by_its_rule_alone.pytestmark[0]
    assert {rule for rule, *_ in TARGET_RULES} == {rule for rule, _ in mark.args[1]}


@pytest.mark.parametrize(
    "right",
    [
        {"rotation": np.array([0.9995, 0, 0, 0])},  # of few decimals
        {"rotation": np.array([-1.0, 0, 0, 0])},
        {"box": np.array([-1.0, 0, CAMERA.width + 1, 40])},  # whole pixels, rounded
        {"keypoints": np.array([[-50.0, 20, 1]])},  # labelled, and not said to be visible
        {"visible": 0.505},
        {"visible": 0.0, "pixels": 0},
        {"visible": None},
        {"rotation": None, "t_cam_body": None},
        {"box": None, "keypoints": None},
    ],
)
def test_rounded_and_missing_numbers_are_no_faults(right) -> None:
    assert not rules([picture("a.png", replace(RIGHT, **right))])


def test_the_worst_picture_is_the_first() -> None:
    pictures = [picture(f"{z}.png", replace(RIGHT, t_cam_body=np.array([0, 0, -float(z)]))) for z in (1, 9, 4)]
    assert list(rules(pictures)["behind-camera"].pictures) == ["9.png", "4.png", "1.png"]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [({"cx": 500.0}, "principal point"), ({"fy": 900.0}, "fx is 700 and fy 900"), ({"fx": 1e6, "fy": 1e6}, "view")],
)
def test_cameras_that_cannot_be_of_the_picture(wrong, words) -> None:
    assert words in rules([picture("a.png", RIGHT, camera=replace(CAMERA, **wrong))])["camera-matrix"].message


def test_wide_and_narrow_lenses_are_no_faults() -> None:
    for focal in (100.0, 20000.0):
        camera = Camera(width=640, height=480, fx=focal, fy=focal, cx=310.0, cy=250.0)
        assert not rules([picture("a.png", RIGHT, camera=camera)])


def test_images_that_are_not_there_or_in_no_list() -> None:
    lost = replace(picture("a.png", RIGHT), exists=False)
    found = rules([lost, picture("b.png", RIGHT)], unlabelled=["c.png"], renamed={"B.png": "b.png"})
    assert found.keys() == {"image-lost", "unlabelled", "image-name"}
    assert list(found["image-lost"].pictures) == ["a.png"]
    assert found["image-name"].repair.names == {"B.png": "b.png"}
    assert {found[rule].severity for rule in ("unlabelled", "image-name")} == {"warning"}


def test_faults_of_readers_are_findings() -> None:
    found = rules([picture("a.png", RIGHT)], faults=[Fault(rule="unreadable", where="x.json", message="is cut short")])
    assert found["unreadable"].where == "x.json"


def test_images_listed_twice_in_one_split_or_in_two() -> None:
    a, moved = picture("a.png", RIGHT, split="train"), replace(RIGHT, t_cam_body=np.array([0.0, 0, 6]))
    assert rules([a, a]).keys() == {"listed-twice"}
    assert rules([a, replace(a, split="test")]).keys() == {"split-overlap"}
    assert not rules([a, picture("b.png", moved, split="test")])


def test_one_pose_in_two_splits_is_a_warning() -> None:
    found = rules([picture("a.png", RIGHT, split="train"), picture("b.png", RIGHT, split="test")])
    assert found["split-overlap"].severity == "warning"


def test_classes_that_no_list_has_or_that_differ_in_spelling() -> None:
    found = rules([picture("a.png", RIGHT), picture("b.png", replace(RIGHT, id="b"))], classes={"a": "aqua"})
    assert list(found["class-unknown"].pictures) == ["b.png"]
    spelled = [picture(f"{name}.png", replace(RIGHT, id=name)) for name in ("Sentinel-6", "sentinel_6")]
    assert rules(spelled).keys() == {"class-spelling"}
    assert not rules([picture(f"{name}.png", replace(RIGHT, id=name)) for name in ("1", "11")])


def test_times_that_go_back_within_a_sequence() -> None:
    def at(name, time, sequence="s"):
        return picture(name, RIGHT, time=time, sequence=sequence)

    assert not rules([at("a", 1.0), at("b", 2.0), at("c", 1.0, "other"), at("d", None)])
    assert list(rules([at("a", 1.0), at("b", 2.0), at("c", 2.0)])["time-order"].pictures) == ["c"]
    assert list(rules([at("a", np.nan), at("b", 2.0)])["time-order"].pictures) == ["a"]

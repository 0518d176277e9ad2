"""The rules on targets: no finding on what was just made, however extreme, and one on each fact that is wrong."""

import json
from dataclasses import replace

import numpy as np
import pytest
from msgspec import to_builtins

from spin_usd.commands.check.in_child.boxes import box_findings
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.checked_target import targets_of
from spin_usd.commands.check.in_child.keypoints import depths_around, keypoint_findings
from spin_usd.commands.check.in_child.labels import count_findings
from spin_usd.commands.check.in_child.pose import MIN_DEGREES, pose_error, pose_findings
from spin_usd.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.picture.target_facts import target_facts
from spin_usd.planning.plan_calls import described_parts, described_target
from spin_usd.records.descriptions import DatasetDescription, StageEntry
from spin_usd.records.record import RecordedCamera
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.body import Body
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.studio.record import recorded_target
from tests.cases.records import record_saying
from tests.cases.scenes import BARREL, SPEEDPLUS, boxes, pose, scene, target, with_first

RULES = (pose_findings, box_findings, count_findings, keypoint_findings)
KINDS = ("depth", "segmentation", "dense_pose", "instance")
CASTER = EmbreeCaster()


def craft():
    """Two boxes before a plate, with keypoints on all of their corners and within."""
    points, faces = boxes()
    keypoints = np.concatenate([points, [[-0.2, 0, 0], [0.6, 0.1, -0.2]]])
    names = tuple(f"k{i}" for i in range(len(keypoints)))
    return replace(target(points, faces), keypoint_names=names, keypoints=keypoints)


CRAFT = craft()
WIDE = replace(BARREL, width=160, height=120, fx=110, fy=110.5, cx=79, cy=61)
LONG = replace(SPEEDPLUS, width=160, height=100, cx=80.5, cy=49)
PLACES = {
    "whole": (0, 0, 4),
    "fills the frame": (0.2, 0.1, 0.9),
    "around the camera": (0, 0, 0.2),
    "partly behind": (0.1, -0.3, -0.3),
    "behind": (0, 0, -4),
    "cut off": (2.6, 0.5, 4),
    "outside": (9, 0, 4),
    "few pixels": (1, 2, 90),
    "none": (3, 1, 2e4),
}


def picture_of(s):
    """The picture of a scene as `check` sees it."""
    surface = visible_surface(s, CASTER.visibility(s))
    facts = target_facts(s, None, CASTER)
    targets = [to_builtins(recorded_target(body, each)) for body, each in zip(s.targets, facts, strict=True)]
    record = {"camera": to_builtins(RecordedCamera.of(s.camera)), "pose": targets[0]["pose"], "targets": targets}
    bodies = [(body.id, before, body.target.parts) for body, before in zip(s.bodies, s.part_offsets, strict=True)]
    description = DatasetDescription(
        stage=StageEntry(root="stage/dataset.usda", hashes={}),
        targets=[described_target(body) for body in s.targets],
        parts=dict(described_parts(bodies, s.bodies)),
        variants=["nominal"],
        frames=1,
        files={},
    )
    return checked(record, {kind: PIXEL_LABELS[kind].make(s, surface) for kind in KINDS}, description)


def json_of(picture):
    """The picture's record as JSON, to be changed at will."""
    return json.loads(json.dumps(to_builtins(picture.record)))


def checked(record, arrays, description):
    """A picture with what that record says, as it is read from its file, and these labels."""
    return CheckedPicture(
        where="records/nominal/frame.json", record=record_saying(**record), description=description, arrays=arrays
    )


def found(picture):
    return [finding for rule in RULES for finding in rule(picture)]


@pytest.fixture(scope="module")
def sound():
    """A picture in which nothing is wrong."""
    s = scene(CRAFT, camera=BARREL, T_cam_body=pose((0.3, 0.5, 0.2, -0.7), (0.3, -0.1, 4)))
    return picture_of(s)


@pytest.mark.parametrize("t", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("q", [(1, 0, 0, 0), (0.3, 0.5, 0.2, -0.7)], ids=["upright", "turned"])
def test_nothing_is_found_on_what_was_just_made(q, t) -> None:
    other = Body(id=2, target=CRAFT, T_cam_body=pose((0.8, -0.1, 0.5, 0.2), np.add(t, (0.4, 0.2, 1.5))))
    alone = scene(CRAFT, camera=WIDE, T_cam_body=pose(q, t))
    assert found(picture_of(alone)) == []
    assert found(picture_of(with_first(replace(alone, camera=LONG), others=(other,)))) == []


def test_the_pose_is_found_again(sound) -> None:
    (seen,) = targets_of(sound)
    error = pose_error(seen)
    assert error is not None
    assert error.degrees < MIN_DEGREES
    assert error.metres < 1e-6


def test_keypoints_that_are_seen_lie_as_deep_as_what_is_seen_there(sound) -> None:
    (seen,) = targets_of(sound)
    states = [state for *_, state in seen.recorded.keypoints]
    around = dict(depths_around(seen))
    assert sum(states[i] == "visible" for i in around) > 5
    deep = [depth.beside for i, depth in around.items() if states[i] == "visible"]
    assert sum(deep) > 0.8 * len(deep)  # at an outer corner pixels may show nothing, or what is beyond


def turned(recorded, degrees):
    """The pose turned a little about the camera's z axis."""
    half = np.radians(degrees) / 2
    about = matrix_from_quaternion((np.cos(half), 0, 0, np.sin(half)))
    rotation = about @ matrix_from_quaternion(recorded["q_cam_body"])
    return {**recorded, "q_cam_body": quaternion_from_matrix(rotation).tolist()}


def change(path, value):
    """A function that puts a value, or what a function makes of the old one, at that path of a record's target."""

    def changed(recorded):
        *above, last = path
        for name in above:
            recorded = recorded[name]
        recorded[last] = value(recorded[last]) if callable(value) else value

    return changed


WRONG = {
    "pose turned": (change(["pose"], lambda p: turned(p, 0.01)), "pose", "degrees and"),
    "pose moved": (change(["pose", "t_cam_body", 2], lambda z: z + 1e-4), "pose", "mm from the record's"),
    "visible box": (change(["box", "visible", 0], lambda x: x + 1), "box", "and the box of its pixels"),
    "no visible box": (change(["box", "visible"], None), "box", "its visible box is None"),
    "amodal box": (change(["box", "amodal", 2], lambda x: x - 2), "box", "beyond its amodal one"),
    "no amodal box": (change(["box", "amodal"], None), "box", "and no amodal one"),
    "truncated": (change(["box", "truncated"], True), "box", "recorded as truncated"),
    "amodal box outside": (change(["box", "amodal", 0], -3.0), "box", "leaves the frame by 3 px"),
    "corner": (change(["box_3d", "corners", 3, 1], lambda v: v + 0.1), "box", "0.1 px from where its pose puts them"),
    "no corner": (change(["box_3d", "corners", 3], None), "box", "inf px from where"),
    "box in metres": (change(["box_3d", "box", 1, 0], lambda x: x - 0.2), "box", "m beyond its 3D box"),
    "visible pixels": (change(["pixels", "visible"], lambda n: n - 1), "pixels", "pixels show it"),
    "amodal pixels": (change(["pixels", "amodal"], lambda n: n + 1), "pixels", "there is nothing else to hide it"),
    "fewer amodal pixels": (change(["pixels", "amodal"], lambda n: n - 1), "pixels", "visible pixels of"),
    "fraction": (change(["visible_fraction"], 0.9), "pixels", "its visible fraction is 0.9"),
    "no fraction": (change(["visible_fraction"], None), "pixels", "has no visible fraction"),
    "keypoint moved": (change(["keypoints", 0, 0], lambda u: u + 0.1), "keypoints", "keypoint k0 is 0.1 px from"),
    "keypoint without pixel": (change(["keypoints", 0], [None, None, "behind"]), "keypoints", "or none where"),
    "keypoint behind": (change(["keypoints", 0, 2], "behind"), "keypoints", "is recorded as behind"),
    "keypoint outside": (change(["keypoints", 0, 2], "outside"), "keypoints", "is recorded as outside"),
    "keypoint missing": (change(["keypoints"], lambda k: k[1:]), "keypoints", "dataset.json lists 26"),
    "all visible": (
        change(["keypoints"], lambda k: [[u, v, "visible"] for u, v, _ in k]),
        "keypoints",
        "m behind the depth",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_told(sound, name) -> None:
    tamper, code, words = WRONG[name]
    record = json_of(sound)
    tamper(record["targets"][0])
    told = found(checked(record, sound.arrays, sound.description))
    assert any(finding.code == code and words in finding.message for finding in told), told
    assert all(finding.message.endswith("run spin-usd check --repair") for finding in told)


def test_keypoints_hidden_by_nothing_are_told(sound) -> None:
    """All are said to be hidden, and the depth there is behind most of them."""
    record = json_of(sound)
    for entry in record["targets"][0]["keypoints"]:
        entry[2] = "self-occluded"
    arrays = {**sound.arrays, "depth": sound.arrays["depth"] + np.float32(1) * (sound.arrays["depth"] > 0)}
    told = found(checked(record, arrays, sound.description))
    assert any("the depth shows nothing before them" in finding.message for finding in told)


def test_a_target_of_several_is_named() -> None:
    other = Body(id=2, target=CRAFT, T_cam_body=pose(t=(0.5, 0.2, 6)))
    s = scene(CRAFT, camera=BARREL, others=(other,))
    picture = picture_of(s)
    record = json_of(picture)
    record["targets"][1]["pixels"]["visible"] += 1
    told = found(checked(record, picture.arrays, picture.description))
    assert told
    assert all(finding.message.startswith("target 2 (T): ") for finding in told)


def test_without_labels_the_facts_are_held_to_one_another(sound) -> None:
    record = json_of(sound)
    assert found(checked(record, {}, sound.description)) == []
    record["targets"][0]["keypoints"][0][0] += 1
    assert len(found(checked(record, {}, sound.description))) == 1

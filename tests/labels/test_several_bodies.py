"""Labels of two targets and an occluder: each body by itself, and what stands before it."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.labels.displacement import PointState
from spin_usd.labels.lit import SunState
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.body import OCCLUDER, Body
from spin_usd.scene.effort import Effort
from tests.cases.bodies import without
from tests.cases.labelled import labels_of, picture_of, sun
from tests.cases.scenes import BARREL, box, pose, scene, target, with_first

CUBE = target(*box())
POSES = (pose((0.9, 0.3, -0.2, 0.1), (-0.3, 0, 4)), pose((0.7, -0.3, 0.2, 0.4), (0.4, 0.2, 5)))
PLATE = target(*box((-0.4, -0.05, -0.05), (0.4, 0.05, 0.05)))
ARM = pose(t=(0, 0.1, 3))
DARK = 1e-4  # W/m2/sr of a white surface in a Sun of 1 W/m2


def bodies(first=POSES[0], second=POSES[1], arm=ARM):
    return {
        "T_cam_body": first,
        "others": (
            Body(id=2, target=replace(CUBE, path="/U"), T_cam_body=second),
            Body(id=OCCLUDER, target=replace(PLATE, path="/Arm"), T_cam_body=arm),
        ),
    }


@pytest.fixture(scope="module")
def made():
    """A cube that hides part of another, behind an arm, and all of it moved in the next frame."""
    now = scene(CUBE, camera=BARREL, lights=[sun((0.6, 0.36, np.sqrt(0.5104)))], **bodies())
    moved = bodies(pose((0.9, 0.3, -0.2, 0.1), (-0.1, 0.1, 4)), pose((0.7, -0.3, 0.2, 0.5), (0.3, 0.2, 5)))
    return replace(now, next_frame=with_first(now, **moved))


@pytest.fixture(scope="module")
def labels(made):
    return labels_of(made)


def alone(made, place):
    """Where body number `place` is if nothing else is there."""
    one = made.one_body_scenes[place]
    return labels_of(replace(one, next_frame=None))["depth"] > 0


def test_no_label_disagrees_with_another(made, labels) -> None:
    picture = picture_of(made, labels)
    assert [fault for label in PIXEL_LABELS.values() for fault in label.faults(picture)] == []


def test_visible_masks_are_of_the_instances(labels) -> None:
    for number in (1, 2):
        bit = labels["mask_visible"] >> (number - 1) & 1
        np.testing.assert_array_equal(bit, labels["instance"] == number)


def test_amodal_masks_are_renders_without_the_others(made, labels) -> None:
    for number in (1, 2):
        bit = labels["mask_amodal"] >> (number - 1) & 1
        np.testing.assert_array_equal(bit, alone(made, number - 1))
    both = labels["mask_amodal"] == 3
    assert both.sum() > 200
    assert (labels["mask_visible"] != labels["mask_amodal"]).sum() > 200


def test_bodies_shade_one_another(made, labels) -> None:
    """As a preview has it, which casts the same rays from the render's side."""
    light = RaycastRenderer().radiance(made, Effort(samples=1), seed=0)
    states = labels["lit"][light.region.slices]
    np.testing.assert_array_equal(light.rgb[..., 0] > DARK, states == SunState.LIT)
    by_themselves = labels_of(replace(made.one_body_scenes[1], next_frame=None))["lit"]
    fallen = (labels["lit"] == SunState.SHADOWED) & (by_themselves == SunState.LIT)
    assert (fallen & (labels["instance"] == 2)).sum() > 50


def test_a_body_outside_the_frame_decides_what_is_lit(made) -> None:
    """Its shadow may fall into it."""
    keys = {
        PIXEL_LABELS["lit"].key(with_first(made, **bodies(arm=pose(t=(0, aside, 3)))), "geometry", 0)
        for aside in (-30, -30, -31)
    }
    assert len(keys) == 2


def test_flow_of_each_body_is_its_own_pose(made, labels) -> None:
    rows, columns = np.nonzero(labels["instance"] == 2)
    flow = labels["flow"][rows, columns].astype(np.float64)
    there = made.next_frame.bodies[1].T_cam_body.points(labels["dense_pose"][rows, columns])
    ends = np.stack([columns + 0.5, rows + 0.5], -1) + flow[:, :2]
    assert np.abs(ends - BARREL.project(there)).max() < 1e-3
    assert (flow[:, 2] == PointState.HIDDEN).sum() > 50


def test_flow_of_a_body_that_is_gone_is_nothing(made) -> None:
    gone = replace(made, next_frame=without(made.next_frame, 1))
    found = labels_of(gone)
    assert not found["flow"][found["instance"] == 2].any()
    assert found["flow"][found["instance"] == 1].any()


def test_an_occluder_has_normals_and_light_but_no_axes(made, labels) -> None:
    arm = (labels["instance"] == 0) & (labels["depth"] > 0)
    assert arm.sum() > 200
    for name in ("normals_cam", "classes", "lit", "flow"):
        assert labels[name][arm].any(-1).all() if labels[name].ndim == 3 else labels[name][arm].all()
    for name in ("normals_body", "nocs", "mask_visible"):
        assert not labels[name][arm].any()

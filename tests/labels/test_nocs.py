"""NOCS brings back the dense pose to half of one of its steps."""

import numpy as np
import pytest

from spin_usd.labels.nocs import STEPS, faults
from tests.cases.labelled import labels_of, picture_of
from tests.cases.scenes import BARREL, box, pose, scene, target

ROUNDED = 0.52  # of a step: half of it, and float32 of the dense pose, of 0.4 m in steps of 1.5 micrometres


@pytest.fixture(scope="module")
def labelled():
    craft = target(*box((-0.2, -0.5, 0.3), (0.7, 0.5, 0.4)))
    made = scene(craft, camera=BARREL, T_cam_body=pose((0.5, -0.3, 0.7, 0.2)))
    return made, labels_of(made)


def test_it_is_the_dense_pose_in_the_targets_box(labelled) -> None:
    """By the formula of docs/reference/dataset.md."""
    made, labels = labelled
    seen = labels["depth"] > 0
    low, high = made.target.mesh.box
    back = low + (labels["nocs"][seen] - 1.0) / STEPS * (high - low)
    off = np.abs(back - labels["dense_pose"][seen]) / ((high - low) / STEPS)
    assert off.max() < ROUNDED


def test_the_boxs_ends_are_1_and_65535(labelled) -> None:
    """Each side of a box is one of its ends."""
    _, labels = labelled
    numbers = labels["nocs"][labels["depth"] > 0]
    assert np.isin(numbers, (1, 65535)).any(-1).all()
    assert numbers.max() == 65535


def test_a_flat_target_is_1_along_the_axis_it_lacks() -> None:
    flat = target([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    numbers = labels_of(scene(flat))["nocs"]
    assert (numbers[numbers.any(-1)][:, 2] == 1).all()


def test_faults_are_found(labelled) -> None:
    made, labels = labelled
    assert list(faults(picture_of(made, labels))) == []
    off = np.where(labels["nocs"] > 1, labels["nocs"] - 1, labels["nocs"]).astype(np.uint16)
    assert [fault.code for fault in faults(picture_of(made, labels, nocs=off))] == ["nocs"]
    assert [fault.code for fault in faults(picture_of(made, labels, nocs=0 * off))] == ["support"]

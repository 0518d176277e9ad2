"""A target refuses parts, materials and keypoints that do not fit; its key is that of its content."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.errors import GeometryError
from spin_usd.scene.material import Material
from spin_usd.scene.target import Part
from tests.cases.scenes import box, target


@pytest.mark.parametrize(
    "change",
    [
        {"parts": ()},
        {"parts": (Part(id=2, path="/p", name="p", class_name="c"),)},
        {"materials": ()},
        {"keypoint_names": ("a",), "keypoints": np.zeros((2, 3))},
        {"keypoint_names": ("a",), "keypoints": [[0, 0, np.nan]]},
    ],
)
def test_bad_targets_are_refused(change) -> None:
    with pytest.raises(GeometryError):
        replace(target(*box()), **change)


def test_part_zero_is_nothing_and_never_a_part() -> None:
    with pytest.raises(GeometryError, match="part"):
        target(*box(), parts=np.arange(12))


@pytest.mark.parametrize(
    "change",
    [
        {"parts": (Part(id=1, path="/p", name="p", class_name="another"),)},
        {"materials": (Material(path="/m", roughness=0.1),)},
        {"keypoint_names": ("a",), "keypoints": np.zeros((1, 3))},
        {"mesh": target(box()[0] * 2, box()[1]).mesh},
        {"mesh": replace(target(*box()).mesh, corner_normals=np.ones((12, 3, 3)))},
    ],
)
def test_targets_that_look_different_have_different_keys(change) -> None:
    assert target(*box()).key == target(*box()).key
    assert replace(target(*box()), **change).key != target(*box()).key


def test_a_materials_key_is_that_of_its_numbers() -> None:
    base = Material(path="/a")
    assert base.key == Material(path="/b").key
    assert base.key != Material(path="/a", roughness=0.51).key

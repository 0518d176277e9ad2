"""Keypoints from a layer of their own: in metres whatever its unit is, with the transforms above them."""

import numpy as np
import pytest

from spin_usd.errors import InputError, StageError
from spin_usd.stage.read.bodies.keypoints import holds_keypoints_alone, read_keypoints_layer

POINTS = """def Points "Keypoints"
    {
        point3f[] points = [(1, 2, 3), (4, 5, 6)]
        string[] primvars:keypointName = ["a", NAME] (interpolation = "vertex")
    }
"""
ABOVE = """#usda 1.0
( metersPerUnit = 0.01 )
def Xform "Craft"
{
    double3 xformOp:translate = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    PRIMS
}
"""
ALONE = "#usda 1.0\n( metersPerUnit = 1 )\n"
EXACT = 1e-12


@pytest.fixture
def written(tmp_path):
    def write(text, second="b"):
        file = tmp_path / "points.usda"
        file.write_text(text.replace("NAME", f'"{second}"'))
        return file

    return write


def test_units_and_transforms_count(written) -> None:
    found = read_keypoints_layer(written(ABOVE.replace("PRIMS", POINTS)))
    assert found.names == ("a", "b")
    assert found.points == pytest.approx(np.array([[1.01, 0.02, 0.03], [1.04, 0.05, 0.06]]), abs=EXACT)


def test_there_must_be_one_prim_of_them_with_a_name_for_each(written) -> None:
    with pytest.raises(InputError, match="has 0 Points prims"):
        read_keypoints_layer(written(ALONE))
    with pytest.raises(InputError, match="has 2 Points prims"):
        read_keypoints_layer(written(ALONE + POINTS + POINTS.replace("Keypoints", "Others")))
    with pytest.raises(StageError, match="names one twice"):
        read_keypoints_layer(written(ALONE + POINTS, second="a"))


def test_a_layer_of_keypoints_alone_is_known(written) -> None:
    assert holds_keypoints_alone(written(ALONE + POINTS))
    assert not holds_keypoints_alone(written(ALONE + POINTS + 'def Xform "Craft" {}'))
    assert not holds_keypoints_alone(written(ABOVE.replace("PRIMS", POINTS)))
